"""Measurements of `bench_brick.py`: how fast a brick computes, and how its motors turn.

In go the names of arms, and ports of motors that turn nothing. Out come tables for people and a
JSON file, by which `simulate --constants FILE` emulates that brick. Begin with `measuring`.

measuring   the order of measurements, and the file
laps        times of pieces of work
computing   control ticks, decisions, messages, on motors that are files
system      Python's start, an access to a motor, waking up
moving      motors turned to and fro, joints against their stops
figures     a motor's constants from how it turned
"""
