"""Let a turtle draw a star of five points.

Try it with `brickservo simulate star.py`, on the brick with `brickservo brick run star.py`.
"""

from robot.api import Turtle

turtle = Turtle()
for _ in range(5):
    turtle.forward(60)
    turtle.left(144)
turtle.done()
