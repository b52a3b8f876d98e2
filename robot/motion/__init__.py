"""How the arm moves: from a path to motor counts."""
