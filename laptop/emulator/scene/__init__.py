"""The synthetic cameras, and the scene that they see.

In go the description of an arm, the constants of scene and cameras, and the arm's true pose over
time.  Out come pictures, BGR and uint8, at their times, and the true pixels of every marker.
Begin with `scene`, whose rules hold everywhere here:

scene             one camera's view: the ground, ink on it, and what moves
synthetic_camera  a camera in time: exposure, delay and jitter around a scene
optics            the lens, colours as light, exact coverage of pixels; `sensor` makes bytes of it
workcell          the arm before the cameras, `planar` or `spatial`
scene_constants   the constants as people write them
camera_rig        several cameras of one arm, and the truth about their pictures
board_photographs, marker_pictures  pictures of a board or of one marker alone
"""
