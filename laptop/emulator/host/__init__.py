"""Emulated Linux of the brick, as a script has it: time, threads, processes, cost of computing.

In goes a script, unmodified, and an emulated brick. Out come its exit status, what it printed, and
what the arm did in virtual time.

Begin with these modules:

    runner     runs a script on a brick; shims: what it replaces of Python's library for that
    world      virtual time, events and the threads of a program
    pacer      a world in step with others in real time (laptop.emulator.pace)
    counting   counts the instructions of a program; instruction_costs: the cost of each step
    processor  turns these counts into seconds
    linux      names, numbers and files of the brick's system
"""
