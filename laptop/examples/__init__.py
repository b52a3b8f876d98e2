"""Short programs to copy: most for the brick, real or emulated, two for the laptop.

Those for the brick import from `robot.api` alone; those for the laptop import `brickservo`.
"""
