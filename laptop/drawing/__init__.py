"""What is to be drawn: read from files, text or the arm itself, placed and put into order."""
