"""The record of a run: its folder and files, its figures, and reports of it.

In go the results of a command: tables, pictures, the true motion, logs of the servo.  Out come the
files of one folder, written whole or not at all, and reports that are made of such folders alone.
Begin with `run`, which says what run.json holds:

run             a run and its tables, to JSON and back
run_folder      the folder that a command has for its results
drawing_tables  the accuracy of drawings as tables
figures/        measures and charts of any run
servo/          runs of the servo: logs read, tables, figures
report/         a report of one run, and the lab report of many
"""
