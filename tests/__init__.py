"""Tests, and what else is measured of the whole: see tests/claims."""
