"""Reflectors around a vehicle, and the bearings under which a scanner sees them."""

from __future__ import annotations

import math

from hypothesis import strategies as st

from daemon.loops.odometry import Pose
from daemon.loops.path import Point

MARKS = {"a": (0.0, 4.0), "b": (5.0, 4.0), "c": (4.0, -3.0), "d": (-3.0, -2.0)}
NOISE_RAD = math.radians(0.2)

places = st.tuples(st.floats(-8, 8), st.floats(-8, 8))
headings = st.floats(-math.pi, math.pi)


def true_bearing(pose: Pose, place: Point) -> float:
    """By turning the reflector into the scanner's frame: another way than the loop's."""
    backwards = complex(math.cos(pose.yaw_rad), -math.sin(pose.yaw_rad))
    turned = complex(place[0] - pose.x_m, place[1] - pose.y_m) * backwards
    return math.atan2(turned.imag, turned.real)
