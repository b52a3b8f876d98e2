"""Iterative learning control: a camera teaches the arm a path.

In: a planned drawing, a rig, a view of a calibrated camera.  Out: joint offsets along each piece of
each stroke, and what error is left, mm.  Begin with `rehearsal`, then `learning`.

way          a planned piece: places, times, Jacobians along it
view         from the marker's pixels to the tip in the arm's frame
tracks       where the tip was seen on each piece
learning     error along and across a piece, and the corrected offsets
lesson       the offsets of one stroke from all its trials
rehearsal    the trials of a drawing
kept         offsets on file
still_table  a check that board and camera stay where they are
"""
