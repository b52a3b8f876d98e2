"""The loop over the frames of all cameras, and the server of the link to the brick.

In come the options of `track` (`options`).  Out go observations to the brick (`server`), rows of a
CSV file (`observation_csv`), lines for people (`status_text`, `status_display`) and events for
programs (`announcements`).

`track` is one run from beginning to end: `setup` checks all options and opens the cameras,
`session` steps a `pipeline` for each camera until the last one has ended or a signal comes.
`pairing_file` keeps the code by which a brick is let in.  Begin with `track.track`.
"""
