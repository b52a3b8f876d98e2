"""Used by both sides: the arm's description, and what goes between laptop and brick."""
