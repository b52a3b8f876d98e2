"""Scripts that pass the checks."""
