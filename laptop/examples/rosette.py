"""Let a turtle draw a star of 18 points, and a circle below it.

Try it with `brickservo simulate rosette.py`,
on the brick with `brickservo brick run rosette.py`.
"""

from robot.api import Turtle

turtle = Turtle()
for _ in range(18):
    turtle.forward(40)
    turtle.left(100)
turtle.penup()
turtle.goto(0, -60)
turtle.pendown()
turtle.circle(30)
turtle.done()
