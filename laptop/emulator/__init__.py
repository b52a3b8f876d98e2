"""Emulated brick: the unmodified python-ev3dev2 on emulated motors and an emulated arm.

In go scripts, an arm's file, constants of the plant and faults. Out come what the scripts print, a
record of the arm's motion, and pictures of emulated cameras.

Begin with these modules:

    rig              an emulated arm with all around it, the way to have one
    device           motors, sensors, gears and the arm's mechanics
    host             the brick's Linux, virtual time and the cost of computing
    scene            what cameras see, and their images
    pace             one clock for several processes in real time
    live             the arm's pose for cameras in other processes
    virtual_tracker  the real server and link in virtual time
    faults           faults, scheduled on the brick, its link and its cameras
    compiled         the same physics as extension modules, if they were built
"""

from laptop.emulator import compiled

compiled.install()
