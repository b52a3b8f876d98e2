"""Calls functions of a student's script on the emulated brick, and writes what they return.

    call_functions.py MODULE QUESTIONS ANSWERS

The one is a list of [name of a function, its arguments] as JSON. The other gets a line once the
module is imported, then one for each answer: {"value": ...} or {"error": words}.  It runs as a
script of its own, so that a function that never returns ends with the brick's time.
"""

import importlib
import json
import os
import sys
import time
import traceback

MYPY = False  # which a type checker takes for true
if MYPY:
    from types import ModuleType  # noqa: F401
    from typing import Any, Dict, Sequence  # noqa: F401


def answer(module, name, arguments):
    # type: (ModuleType, str, Sequence[Any]) -> Dict[str, Any]
    """Return what a function answers, or what went wrong, with the line."""
    try:
        return {"value": getattr(module, name)(*arguments)}
    except (Exception, SystemExit) as error:
        lines = [
            entry[1]
            for entry in traceback.extract_tb(sys.exc_info()[2])
            if os.path.splitext(os.path.basename(entry[0]))[0] == module.__name__
        ]
        where = "line {}: ".format(lines[-1]) if lines else ""
        return {"error": "{}{}: {}".format(where, type(error).__name__, error)}


def main(module, questions, answers):
    # type: (str, str, str) -> None
    """Answer the questions of one file in another."""
    with open(questions) as file:
        asked = json.load(file)
    student = importlib.import_module(module)
    time.sleep(0)  # from here on what is computed takes the brick's time
    with open(answers, "w") as file:
        file.write("imported\n")
        for name, arguments in asked:
            file.flush()  # it may be the last that is heard
            file.write(json.dumps(answer(student, name, arguments), default=repr) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
