"""One marker in one frame: a finder for each kind, and what they measure with.  Pure.

In come a picture, its time, the marker and its `Track` so far; out comes the new `Track`.
`aruco` reads codes, `ball` and `disc` go by colour: `color_search` follows a marker in its window
or searches the whole frame, and calls what measures it there.

A disc is measured by a soft centroid (`disc`), a ball by the contour that most of its rim lies on
(`circle_measurement`), a moving disc by its smear (`smeared_disc`), a code by all of its cells
(`code_alignment`).  `confidence` makes one number of what was measured.  Begin with
`color_search.find_by_color`.
"""
