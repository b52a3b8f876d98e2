"""Where this user's programs keep what they remember."""

import os


def state_folder():
    """$BRICKSERVO_STATE, or ~/.brickservo; it need not exist yet."""
    return os.environ.get("BRICKSERVO_STATE") or os.path.expanduser("~/.brickservo")
