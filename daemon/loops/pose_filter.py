"""An extended Kalman filter for the pose: the odometry moves it, bearings to reflectors correct it.

Thrun, Burgard & Fox, Probabilistic Robotics, 7.4: each bearing by itself, after a test whether it can be that
reflector. Bearings tell where the scanner was when it saw the reflector: the way since then is known from the odometry.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from msgspec.structs import astuple

from daemon.loops.localisation import (
    Covariance,
    Fix,
    bearing,
    bearing_row,
    composed,
    inverted,
    triangulated,
)
from daemon.loops.odometry import Pose
from daemon.loops.path import Point, wrap

GATE: Final = 10.83
"""Squared standard deviations that one in a thousand right bearings exceeds (chi squared, one degree of freedom)."""
LOST_AFTER: Final = 5
"""Scans in a row of which most does not fit, after which the pose is begun anew."""
HISTORY_S: Final = 1.0


@dataclass(frozen=True, slots=True)
class FilterNoise:
    """What the filter expects.

    Attributes:
        bearing_rad: standard deviation of a bearing.
        way: standard deviation of the odometry's way after a metre [m].
        turn_rad: standard deviation of its heading after a metre.
    """

    bearing_rad: float
    way: float
    turn_rad: float


class SeenBearing(NamedTuple):
    """One bearing of a scan: to a reflector by its name, or to one of them (None)."""

    bearing_rad: float
    reflector: str | None = None


class Correction(NamedTuple):
    """What a scan did.

    Attributes:
        used, rejected: numbers of bearings.
        moved_m: by how much the pose was corrected.
        anew: the pose was begun anew.
    """

    used: int
    rejected: int
    moved_m: float
    anew: bool


class PoseFilter:
    """Where the vehicle is, in the frame of the reflectors.

    Args:
        reflectors: their places by name.
        noise: what is expected of bearings and odometry.

    Attributes:
        pose: of the vehicle; that of the odometry until there is a fix.
        covariance: of the pose; None until there is a fix.
    """

    def __init__(self, reflectors: Mapping[str, Point], noise: FilterNoise) -> None:
        self._reflectors, self._noise = dict(reflectors), noise
        self.pose = Pose()
        self.covariance: Covariance | None = None
        self._way = Pose()
        self._ways: deque[tuple[float, Pose]] = deque()
        self._unfit = 0

    def move(self, odometry: Pose, time_s: float, mounting: Pose) -> None:
        """Follow the odometry.

        Args:
            odometry: where it says that the vehicle is; it goes on from the filter's pose.
            time_s: now.
            mounting: pose of the scanner in the vehicle's frame, now.
        """
        step = composed(inverted(self.pose), odometry)
        dx, dy = odometry.x_m - self.pose.x_m, odometry.y_m - self.pose.y_m
        self.pose = odometry
        self._way = composed(self._way, step)
        self._ways.append((time_s, composed(self._way, mounting)))
        while self._ways[0][0] < time_s - HISTORY_S:
            self._ways.popleft()
        way = math.hypot(dx, dy)
        if self.covariance is not None and way:
            across, turn = self._noise.way**2 * way, self._noise.turn_rad**2 * way
            xx, xy, yy, xt, yt, tt = self.covariance.carried(dx, dy)
            self.covariance = Covariance(xx + across, xy, yy + across, xt, yt, tt + turn)

    def take(self, scan: Sequence[SeenBearing], seen_s: float) -> Correction:
        """Correct the pose by a scan.

        Args:
            scan: its bearings; those that name an unknown reflector are rejected.
            seen_s: time at which it was taken.
        """
        relative = composed(inverted(self._way), self._scanner_at(seen_s))
        before = self.pose
        used = 0
        if self.covariance is not None:
            used = sum(self._correct(seen, relative) for seen in scan)
            self._unfit = 0 if 2 * used >= len(scan) else self._unfit + 1
        anew = self.covariance is None or self._unfit >= LOST_AFTER
        fix = self._fix(scan) if anew else None
        if fix is not None:
            self._begin(fix, relative)
            used, self._unfit = len(scan), 0
        moved = math.hypot(self.pose.x_m - before.x_m, self.pose.y_m - before.y_m)
        return Correction(used, len(scan) - used, moved, fix is not None)

    def _scanner_at(self, seen_s: float) -> Pose:
        """Where the scanner was at a time, in the frame of the odometry alone; of the last second."""
        later_s, later = self._ways[-1]
        for time_s, scanner in reversed(self._ways):
            if time_s <= seen_s:
                share = min(1.0, (seen_s - time_s) / (later_s - time_s)) if later_s > time_s else 0.0
                return Pose(
                    *(one + share * (two - one) for one, two in zip(astuple(scanner), astuple(later), strict=True))
                )
            later_s, later = time_s, scanner
        return later

    def _correct(self, seen: SeenBearing, relative: Pose) -> bool:
        """Take one bearing, if it fits."""
        assert self.covariance is not None
        scanner = composed(self.pose, relative)
        names = self._reflectors if seen.reflector is None else [seen.reflector]
        places = [self._reflectors[name] for name in names if name in self._reflectors]
        if not places:
            return False
        place = min(places, key=lambda place: abs(wrap(seen.bearing_rad - bearing(scanner, place))))
        row = bearing_row(scanner, place)
        if row is None:
            return False
        a, b, c = row
        c += b * (scanner.x_m - self.pose.x_m) - a * (scanner.y_m - self.pose.y_m)
        xx, xy, yy, xt, yt, tt = self.covariance
        px, py, pt = xx * a + xy * b + xt * c, xy * a + yy * b + yt * c, xt * a + yt * b + tt * c
        variance = a * px + b * py + c * pt + self._noise.bearing_rad**2
        error = wrap(seen.bearing_rad - bearing(scanner, place))
        if error * error > GATE * variance:
            return False
        x, y, turn = (error * part / variance for part in (px, py, pt))
        self.pose = Pose(self.pose.x_m + x, self.pose.y_m + y, self.pose.yaw_rad + turn)
        self.covariance = Covariance(
            xx - px * px / variance,
            xy - px * py / variance,
            yy - py * py / variance,
            xt - px * pt / variance,
            yt - py * pt / variance,
            tt - pt * pt / variance,
        )
        return True

    def _fix(self, scan: Sequence[SeenBearing]) -> Fix | None:
        """The pose from a scan alone; only bearings with a name tell it."""
        named = {seen.reflector: seen.bearing_rad for seen in scan if seen.reflector in self._reflectors}
        sightings = [(self._reflectors[name], angle) for name, angle in named.items() if name is not None]
        fix = triangulated(sightings)
        return fix if fix is not None and fix.residual_rad**2 <= GATE * self._noise.bearing_rad**2 else None

    def _begin(self, fix: Fix, relative: Pose) -> None:
        """Take a fix of the scanner for the vehicle's pose."""
        pose = composed(fix.pose, inverted(relative))
        turns = round((self.pose.yaw_rad - pose.yaw_rad) / math.tau)
        self.pose = Pose(pose.x_m, pose.y_m, pose.yaw_rad + turns * math.tau)
        unit = fix.unit.carried(pose.x_m - fix.pose.x_m, pose.y_m - fix.pose.y_m)
        self.covariance = unit.scaled(self._noise.bearing_rad**2)
