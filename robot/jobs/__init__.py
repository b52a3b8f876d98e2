"""Jobs: drawing files that the brick draws alone, stroke by stroke.

In goes a job file (shared.job.Job: joint motions planned by a laptop), the arm, and orders from
buttons, keys, a file or the link. Out come the drawing, a status file, lines for people, a log.
Begin with `runner`.

runner    draws the strokes, pauses on their path, resumes
checking  what a job may ask of the arm, checked before anything moves
learned   offsets that a camera has taught, merged into the plan
way       PenPath: the path from pen down to pen up, and where on it the arm is
orders    pause, resume, abort, speed, pen, nudge, and who gives them
report, progress, logbook   the status, what a resumed job needs, the motors' log
linked, linked_drawing, fetching   a job that comes over the link and is watched there
"""
