"""One run folder: what a run left, its figures, and the reports of it."""
