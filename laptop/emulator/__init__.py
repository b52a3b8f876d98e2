"""The emulated brick: the unmodified python-ev3dev2 on emulated motors and an emulated arm."""
