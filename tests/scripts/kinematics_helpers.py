"""Shared by the drawing lab: two-link arm geometry in cm and degrees."""
import math

L1, L2 = 11.3, 9.5


def inverse(x, y):
    c2 = (x * x + y * y - L1 * L1 - L2 * L2) / (2 * L1 * L2)
    q2 = math.acos(max(-1.0, min(1.0, c2)))
    q1 = math.atan2(y, x) - math.atan2(L2 * math.sin(q2), L1 + L2 * math.cos(q2))
    return math.degrees(q1), math.degrees(q2)
