"""Calls functions of a student's script on the emulated brick, and writes what they return.

    examiner.py MODULE QUESTIONS ANSWERS

Two files of JSON: a list of [name of a function, its arguments], and a list of {"value": ...} or
{"error": words}.  It runs as a script of its own, so that a function that never returns ends with
the brick's time.
"""

import importlib
import json
import os
import sys
import traceback


def answer(module, name, arguments):
    """Return what a function answers, or what went wrong, with the line."""
    try:
        return {"value": getattr(module, name)(*arguments)}
    except Exception as error:
        lines = [
            entry[1]
            for entry in traceback.extract_tb(sys.exc_info()[2])
            if os.path.splitext(os.path.basename(entry[0]))[0] == module.__name__
        ]
        where = "line {}: ".format(lines[-1]) if lines else ""
        return {"error": "{}{}: {}".format(where, type(error).__name__, error)}


def main(module, questions, answers):
    """Answer the questions of one file in another."""
    with open(questions) as file:
        asked = json.load(file)
    student = importlib.import_module(module)
    found = [answer(student, name, arguments) for name, arguments in asked]
    with open(answers, "w") as file:
        json.dump(found, file, default=repr)


if __name__ == "__main__":
    main(*sys.argv[1:])
