"""From pictures to where markers are: in px, in cm on the table, and to the brick.

In come pictures of webcams, films, streams and folders.  Out go observations, at which pixel each
marker is and how sure that is, to the brick and to a CSV file; and places in cm, once the camera
has seen the printed board.

camera/   pictures come in: webcams, films, streams, folders
markers/  what a marker looks like, where it is, and how sure that is
table/    from px to cm: the camera over the printed board
serve/    the loop over the frames of all cameras, and the link to the brick

Imports go one way: `table`, `serve`, `markers`, `camera`; each knows only those named after it.
Begin with `serve/pipeline.py`: `CameraPipeline.step` is the way of one frame through all of them.
"""
