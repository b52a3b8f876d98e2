"""What the run.json in a folder tells, flat, as tests look at it."""

import json
from pathlib import Path


def run_in(folder):
    """The ending and what it tells more, the set-up, and the rows of each table by its name."""
    run = json.loads((Path(folder) / "run.json").read_text(encoding="utf-8"))
    ending = run["ending"]
    tables = {table["name"]: rows_of(table) for table in run["tables"]}
    flat = {**run, **run["set_up"], **ending, **ending["more"], "paths": [], **tables}
    return {**flat, "files": [file["name"] for file in run["files"]]}


def rows_of(table):
    """The rows of a table by its headings, "greatest mm" one of them."""
    headings = [f"{column['name']} {column['unit']}".strip() for column in table["columns"]]
    return [dict(zip(headings, row)) for row in table["rows"]]
