"""CSV files, as tests look at them."""

import csv


def rows_in(path):
    """Each row by the headings."""
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))
