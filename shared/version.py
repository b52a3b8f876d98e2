"""Version of the whole software: laptop and brick report theirs, and whether they are the same."""

VERSION = "0.2.0"
