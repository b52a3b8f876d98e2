"""Devices on the brick: motors, sensors, screen and buttons, and the arm behind the encoders."""
