"""The computer below all rooms: its platform, files for people, headers of pictures.

In: paths and bytes.  Out: files that are whole or not there, findings, sizes of pictures.  Begin
with `files`.

files          write files whole, never over another kind of file
platforms      what differs between Linux, macOS and Windows: signals, locks, processes
picture_heads  size of a picture from its header, before it is decoded
decoders       image libraries, kept from writing on the terminal
findings       what a check of the computer has found
"""
