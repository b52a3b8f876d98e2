"""Drawing by sight: a camera sees where the tip went, and the arm learns from it."""
