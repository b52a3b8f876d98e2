"""One marker in one frame: a finder for each kind, and what they measure with.  Pure."""
