"""What is plugged in: motors, sensors, screen and buttons, and the arm behind the encoders."""
