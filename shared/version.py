"""The version of all of it: laptop and brick tell people theirs, and whether they are the same."""

VERSION = "0.2.0"
