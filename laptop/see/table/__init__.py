"""From what the camera saw to millimetres, and how sure they are."""
