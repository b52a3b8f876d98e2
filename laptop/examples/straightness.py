"""Measure how straight the emulated arm draws a line, by the backlash that it truly has.

The arm's file says 2 degrees. It runs on the laptop, in a checkout:
`.uv/bin/uv run python laptop/examples/straightness.py`.
"""

import math

import brickservo

(AX, AY), (BX, BY) = (10, 0), (5, 10)  # the line's ends, cm

for backlash in (1, 2, 3):
    with brickservo.Rig("planar", plant=f"backlash={backlash}") as rig:
        run = rig.run("driver.py", "line", f"{AX},{AY}", f"{BX},{BY}")
    off = [
        10 * abs((sample.x - AX) * (BY - AY) - (sample.y - AY) * (BX - AX))
        for sample in run.record
        if sample.pen
    ]
    greatest = max(off) / math.dist((AX, AY), (BX, BY))
    print(f"{backlash} degrees: {greatest:.2f} mm off the line at most")
