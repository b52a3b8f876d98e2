"""The names of the files that every run leaves; the emulated brick's side reads them, too."""

RUN = "run.json"
"""What the run was, how it ended, what it measured, and which files are its own."""

TRACE = "trace.csv"
"""The true motion of an emulated arm."""
