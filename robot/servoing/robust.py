"""What is seen may be something else: the farther off, the less it counts.  Pure."""

ROBUST = 3.0
"""Residuals beyond so many standard deviations count ever less (Geman and McClure)."""


def trust(excess):
    """Weight of a residual by its square, as a share of what is still believed."""
    return 1.0 if excess <= 1 else (1.0 + excess) ** -2
