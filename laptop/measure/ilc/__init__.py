"""Iterative learning control: a camera teaches the arm a path.

In: a planned drawing, a rig, a view of a calibrated camera.  Out: joint offsets along each piece of
each stroke, and what error is left, mm.  Begin with `trials`, then `learning`.

piece_path       a planned piece: places, times, Jacobians along it
view             from the marker's pixels to the tip in the arm's frame
tracks           where the tip was seen on each piece
learning         error along and across a piece, and the corrected offsets
stroke_learning  the offsets of one stroke from all its trials
trials           the trials of a drawing
stroke_choice    a few strokes that stand for all
arm_errors       errors of an arm's description, by which other strokes' offsets are foretold
sampled_trials   the trials of a few strokes, for all of a drawing
stored_offsets   offsets on file
still_table      a check that board and camera stay where they are
"""
