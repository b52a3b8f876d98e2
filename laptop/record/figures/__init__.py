"""Charts, tables and documents of any run; what a drawing is worth."""
