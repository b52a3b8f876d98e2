"""Compare the law of bold_servo.py with two of BrickServo's before the same emulated camera.

Each brings the tip to the pixel (400, 200). It runs on the laptop, in a checkout:
`.uv/bin/uv run python laptop/examples/compare_laws.py`.
"""

from pathlib import Path

import brickservo

LAWS = {
    "bold": [str(Path(__file__).with_name("bold_servo.py"))],
    "report": ["visual_servoing.py", "--goal", "400,200", "--method", "report"],
    "chain": ["visual_servoing.py", "--goal", "400,200", "--method", "chain"],
}

lines = []
for law, words in LAWS.items():
    with brickservo.Rig("planar", cameras="tilt=20") as rig:
        run = rig.run(*words)
        x, y = rig.tip  # the true one, cm
    lines.append(f"{law}: {run.outcome.t - run.began:.1f} s, tip at {x:.1f}, {y:.1f} cm")
print(*lines, sep="\n")
