"""The brick itself, by python-ev3dev2, which is named nowhere else in robot."""
