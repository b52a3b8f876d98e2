"""Runs on the brick: Python 3.5, the standard library and python-ev3dev2, nothing else."""
