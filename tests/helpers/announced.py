"""Reading of what `track --json` writes, for tests that start it."""

import json


def wait_for_event(lines, event):
    """The first object with this event among lines of JSON; those before it are skipped."""
    for line in lines:
        told = json.loads(line)
        if told["event"] == event:
            return told
    raise AssertionError(f"it was never announced: {event}")
