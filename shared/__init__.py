"""Code of laptop and brick alike: the arm's description, their messages, and jobs on file.

In go arm files, lines from the network and job files. Out come checked, immutable records.
All of it runs on the brick, too: Python 3.5 and its standard library.

Begin with these modules:

    arm_description  an arm's file, read and checked: Arm, Joint, Pen
    messages         the messages between laptop and brick, and their lines of JSON
    link             one connection: framing, signatures, pings, the newest observations
    pairing          the handshake by a pairing code; signing: the lines after it
    peer_clock       the offset of the other side's clock
    job              a drawing on file, stroke by stroke
    state            environment variables and files that processes share
"""
