"""Everything at once, on this machine alone, and whether it truly worked."""
