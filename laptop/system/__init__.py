"""What all rooms ask of the computer: its platform, files for people, the heads of pictures."""
