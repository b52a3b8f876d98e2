#!/usr/bin/env python3
import argparse
import os
import sys
from datetime import datetime

from ev3dev2.motor import OUTPUT_A, OUTPUT_B, LargeMotor, SpeedPercent
from ev3dev2.sound import Sound
from kinematics_helpers import inverse

parser = argparse.ArgumentParser(description='go to the points of a file, relative to the first')
parser.add_argument('--file', default='points.txt')
parser.add_argument('--speed', type=int, default=10)
args = parser.parse_args()

path = os.path.join(os.path.dirname(os.path.abspath(__file__)), args.file)
if not os.path.exists(path):
    sys.exit('no such file: ' + args.file)
with open(path) as f:
    points = [tuple(float(word) for word in line.split()) for line in f if line.strip()]

a, b = LargeMotor(OUTPUT_A), LargeMotor(OUTPUT_B)
start = datetime.now()
first = inverse(*points[0])
zero = a.position, b.position
for x, y in points:
    q = inverse(x, y)
    a.on_to_position(SpeedPercent(args.speed), round(zero[0] + q[0] - first[0]), block=False)
    b.on_to_position(SpeedPercent(args.speed), round(zero[1] + q[1] - first[1]), block=True)
    a.wait_until_not_moving()
    Sound().beep(play_type=Sound.PLAY_NO_WAIT_FOR_COMPLETE)
    print("({:.1f}, {:.1f}): {} {}".format(x, y, a.position, b.position))
print("took %.1f s" % (datetime.now() - start).total_seconds())
a.off()
b.off()
