"""From pictures to where markers are: in px, in cm on the table, and to the brick.

camera/   pictures come in: webcams, films, streams, folders
markers/  what a marker looks like, where it is, and how sure that is
table/    from px to cm: the camera over the printed board
serve/    the loop over the frames of all cameras, and the link to the brick
"""
