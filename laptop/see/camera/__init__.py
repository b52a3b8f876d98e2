"""Pictures come in: from webcams, films, streams and folders, each with its time.

In comes a text as people type it: a number, a file, a folder, an address.  Out come `Frame`s: a
picture (BGR, uint8), its index, and when it was taken, s.  A live camera gives the newest frame,
taken by a thread; a recording gives every frame, or plays at its own pace.  What cannot be opened
is a `NoCamera`, which says in a sentence what to do.

Begin with `cameras.open_camera`, then `frames.Frame`; `live_cameras` and `recordings` are the two
kinds, and `containers` looks into damaged files.
"""
