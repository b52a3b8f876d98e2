"""How tests wait for what another thread or process does: for as long as it takes.

No test may count on how fast a machine is, or how busy. What is bound to come is waited for; only
what hangs meets the deadline.
"""

import time

import stacks

PATIENCE = 300.0
"""After so long it hangs, s."""


def until(condition, what, meanwhile=lambda: time.sleep(0.002)):
    """Wait until `condition()` holds, and return what it gave.

    Args:
        condition: asked again and again.
        what: has not come, if it never does.
        meanwhile: called in between.
    """
    deadline = time.monotonic() + PATIENCE
    while True:
        found = condition()
        if found:
            return found
        if time.monotonic() > deadline:
            stacks.show()
            raise AssertionError(what + ": it never came")
        meanwhile()
