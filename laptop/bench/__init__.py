"""What the programs are worth, measured beside the reference method and the physical limit."""
