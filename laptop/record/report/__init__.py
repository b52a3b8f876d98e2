"""A lab report of the runs in a folder: what their files hold, and nothing else."""
