"""Kinds of markers that can be looked for, as people write them; `tracker` has what finds each."""

COLOR_KINDS = ("disc", "ball")
"""Kinds of one colour, which can be named and picked."""

KINDS = (*COLOR_KINDS, "aruco")
