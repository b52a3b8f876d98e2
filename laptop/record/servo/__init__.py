"""Runs of the servo: their logs, tables and figures.

In go logs of visual_servoing.py, pictures of the cameras, and the truth where an emulator knows it.
Out come tables and figures, as PNG, for a run's record.  Begin with `servo_run`:

servo_run    one run to one goal, from a log; tables of steps and goals
servo_log    the log, read from its file
figures      the figures: cameras, space, errors, joints
servo_files  tables and files that runs of the servo add to a record
"""
