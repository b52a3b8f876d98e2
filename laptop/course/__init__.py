"""How to build an arm, and what a class does with it.

In comes an arm's file; out comes the building guide, a page of HTML with drawings true to scale
(`build`, `drawing`, `lego`, `troubles`).  The handouts of a class are pages and scripts
(`handouts`): what passes is in `solutions/`, and marked in it, what students begin with.

A student's script is run on an emulated brick (`examination`; `call_functions` is the part that
runs there), and judged by oracles that know nothing of the solutions (`criteria`).  Begin with
`build.render_guide` for the guide, and with `handouts.HANDOUTS` for the class.
"""
