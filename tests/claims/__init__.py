"""What this project says of itself, measured like a bench: `python -m tests.claims NAME`."""
