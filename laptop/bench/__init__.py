"""Benches: the programs beside the reference method and the physical limit."""
