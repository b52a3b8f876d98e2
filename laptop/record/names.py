"""Names of the files that every run leaves; the emulator's modules read them, too."""

RUN = "run.json"
"""Name of the record: kind of the run, its ending, its measurements, and its own files."""

TRACE = "trace.csv"
"""Name of the true motion of an emulated arm."""
