"""Measures, charts and documents of any run.

In go rows of the true motion, wanted paths and points, in cm and s.  Out come deviations in mm, and
pictures as PNG, SVG or HTML.  Begin with `line_accuracy`, which measures, and `sheet`, on which
everything is drawn:

line_accuracy  the ink against wanted paths; `drawing_plot`: against a whole drawing
sheet          axes in cm of equal scales, and the style of all figures
line_plot      the picture of a run with an arm; `robot_plot`: of a robot on wheels
charts         parts of the servo's figures
learning_plot  drawings of one path, over one another
document       a report as one HTML file; `formulas`: formulas in it
"""
