"""Where the robot is, from what its wheels have rolled and where its pairs point."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Final

import msgspec

from daemon.loops.geometry import FRONT, REAR, TURN_SIGN, WHEELS_OF_PAIR, PerPair
from daemon.loops.least_squares import Fits, Row
from daemon.loops.measurement import Measurement
from profiles.schema import PairedSteerGeometry

MAX_STEP_M: Final = 0.5
"""A wheel that seems to have rolled farther since the last reading was counted anew, or its reading is wrong."""
MAX_TURN_RAD: Final = 0.5
"""The same for the heading of a pair."""


class Pose(msgspec.Struct, frozen=True, gc=False):
    """Position and attitude of the robot's centre in the frame where the odometry was reset."""

    x_m: float = 0.0
    y_m: float = 0.0
    yaw_rad: float = 0.0


def moved_along_arc(pose: Pose, forward_m: float, left_m: float, turn_rad: float) -> Pose:
    """The pose after a motion with a constant twist: exact on arcs and on lines.

    With s = sin(t)/t and c = (1 - cos t)/t the displacement in the frame of the start is
    (s dx - c dy, c dx + s dy), which is the exponential map of the plane's rigid motions.
    """
    if abs(turn_rad) < 1e-6:
        s, c = 1.0, turn_rad / 2
    else:
        s, c = math.sin(turn_rad) / turn_rad, (1 - math.cos(turn_rad)) / turn_rad
    ahead, aside = s * forward_m - c * left_m, c * forward_m + s * left_m
    cos, sin = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return Pose(pose.x_m + cos * ahead - sin * aside, pose.y_m + sin * ahead + cos * aside, pose.yaw_rad + turn_rad)


class Odometry:
    """Adds up wheel travel to a pose.

    Between two readings the body's motion (dx, dy, dyaw) is the least-squares answer to six statements: each of the
    four wheels has rolled what it says along its heading at its contact point, and midway between the contact points
    of each pair nothing moves sideways. (Single wheels do slip sideways on a curve, the two of a pair by the same
    amount in opposite directions.) What a pair's wheels roll to turn the pair is taken off before.

    Attributes:
        pose: where the robot's centre is.
        skipped: readings that were not used because they cannot be true.
    """

    def __init__(self, geometry: PairedSteerGeometry) -> None:
        self._offset_m = geometry.contact_offset_m
        self._fits = Fits(partial(body_rows, geometry))
        self._last: Measurement | None = None
        self.pose = Pose()
        self.skipped = 0

    def reset(self, pose: Pose | None = None) -> None:
        """Start again at ``pose`` (default: the origin)."""
        self.pose = Pose() if pose is None else pose

    def update(self, measurement: Measurement) -> Pose:
        """Take one cycle's wheel travel and headings; the first one only sets the start."""
        last, self._last = self._last, measurement
        if last is None:
            return self.pose
        rolled = [new - old for new, old in zip(measurement.wheel_travel_m, last.wheel_travel_m, strict=True)]
        turned = [new - old for new, old in zip(measurement.heading_rad, last.heading_rad, strict=True)]
        if not (_within(rolled, MAX_STEP_M) and _within(turned, MAX_TURN_RAD)):
            self.skipped += 1
            return self.pose
        if any(rolled) or any(turned):
            mean = (last.heading_rad[0] + turned[0] / 2, last.heading_rad[1] + turned[1] / 2)
            self.pose = moved_along_arc(self.pose, *self._body_motion(mean, rolled, turned))
        return self.pose

    def _body_motion(self, heading_rad: PerPair, rolled_m: list[float], turned_rad: list[float]) -> Row:
        """The twist (dx, dy, dyaw) at the mean headings."""
        if any(turned_rad):
            turned_m = [self._offset_m * turn for turn in turned_rad]
            rolled_m = [way - TURN_SIGN[wheel] * turned_m[wheel // 2] for wheel, way in enumerate(rolled_m)]
        return self._fits.at(heading_rad).unknowns(rolled_m)


def _within(values: list[float], limit: float) -> bool:
    """Whether no value is beyond a limit; one that is no number is."""
    return all(map(limit.__ge__, map(abs, values)))


def body_rows(geometry: PairedSteerGeometry, heading_rad: Sequence[float]) -> list[Row]:
    """What a twist of the body makes of the wheels: their ways, and then of each pair that of its middle to the side.

    A point (x, y) moves along a heading p by (cos p, sin p, x sin p - y cos p) times the twist, and to its left by
    (-sin p, cos p, x cos p + y sin p) times it; the contact points of ``daemon.loops.geometry`` are put in.
    """
    rows: list[Row] = []
    middles: list[Row] = []
    for pair, end in ((REAR, -1.0), (FRONT, 1.0)):
        cos, sin = math.cos(heading_rad[pair]), math.sin(heading_rad[pair])
        axis_m = end * geometry.wheelbase_m / 2
        arm_m = geometry.pivot_track_m / 2 * cos + geometry.contact_offset_m
        rows.extend((cos, sin, axis_m * sin + TURN_SIGN[wheel] * arm_m) for wheel in WHEELS_OF_PAIR[pair])
        middles.append((-sin, cos, axis_m * cos + end * geometry.contact_lead_m))
    return rows + middles
