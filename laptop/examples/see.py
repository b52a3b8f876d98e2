"""Print where each camera sees the tip, until Ctrl-C.

Try it with `brickservo simulate --scene "" see.py`,
on the brick with `brickservo brick run see.py`; there `brickservo track` runs on the laptop.
"""

from robot.api import Clock, TrackingClient, find_tracker

client = TrackingClient(*find_tracker(), clock=Clock())
while True:
    for camera, seen in client.poll(timeout=0.1).items():  # the newest only, each once
        # s on the brick's clock; (u, v, confidence), or None if it was not seen
        print(camera, seen.t, seen.markers["effector"])
    if not client.linked:
        print(client.why)  # hold the arm: nothing old is ever handed over
