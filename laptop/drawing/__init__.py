"""What is to be drawn: read from files, text or the arm itself, placed and put into order.

In comes a file or its bytes (`sources`): an SVG, a picture, a text; or a test pattern.  It becomes
an `Artwork`, strokes in cm on a sheet of their own.  Out comes a `DrawingPlan`: where on the table
it lies, in which order, by which joint motions and in how many seconds, what cannot be reached, and
the job's file that the brick draws alone.

Begin with `preparing.prepare`, whose steps are modules in this order: `placing`, `strokes` (cut
where the arm cannot follow), `merging`, `ordering`, `planning`, `timing`.  For what is read, begin
with `sources.read_source`, then `artwork.Artwork`.
"""
