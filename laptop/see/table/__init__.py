"""From what the camera saw to places on the table, cm, and how sure they are.

In come views of the printed board (`markers.finders.board`), pixels of markers, and the joints'
angles.  Out come a `CameraModel` with its covariance, places in cm, and where an arm stands.

`camera_fit` calibrates a camera by the board, `views_fit` is its least squares and `camera_model`
what comes of it; `board_watch` does so while tracking runs.  `marker_offset` finds where the marker
sits from touched crosses, `moves_fit` a camera by the tip's own moves, `two_cameras` places in
space.  Begin with `camera_model.CameraModel`, then `camera_fit.calibrate`.
"""
