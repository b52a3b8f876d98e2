"""Appearance, detection and confidence of markers.

In come a picture (BGR, uint8), its time in s, and the `Marker`s to look for: discs and balls of a
colour, or ArUco codes.  Out comes a `Sighting` for each: u, v in px, a confidence from 0 to 1 and a
radius, or None with the reason in words.  A marker's colour comes from its name, from a picked
pixel (`learning`) or from a file (`markers`).

Begin with `tracker.Tracker.find`, then `tracks.Track`, what is known of a marker from frame to
frame; `finders/` has a finder for each kind.  `board` is the printed board, `two_views` relates
two cameras of which nothing is known.
"""
