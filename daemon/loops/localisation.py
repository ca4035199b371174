"""Position and heading from bearings to reflectors whose places are known: at once, and filtered with the odometry.

A bearing b to the reflector (X, Y) from the pose (x, y, t) says sin(b + t) (X - x) = cos(b + t) (Y - y). With
u = x cos t + y sin t and w = x sin t - y cos t this is linear in (cos t, sin t, u, w) and without a constant::

    (sin b X - cos b Y) cos t + (cos b X + sin b Y) sin t - sin b u - cos b w = 0

Three bearings make three such rows, whose common null vector is the pose but for its length. On the circle through the
three reflectors the null space grows: every point of it sees them alike. Near to it the pose is there, but a small
error of a bearing moves it far; the dilution tells how far (McGillem & Rappaport 1989). More bearings are fitted by
least squares (Gauss-Newton).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations
from typing import Final, NamedTuple

from daemon.loops.least_squares import least_squares, normal
from daemon.loops.odometry import Pose
from daemon.loops.path import Point, wrap

Sighting = tuple[Point, float]
"""A reflector's place and the bearing to it [rad], counter-clockwise from the scanner's heading."""
Row = tuple[float, float, float]

MAX_DILUTION_M_RAD: Final = 50.0
"""Error of the position [m] for an error of the bearings [rad] from which a pose is none: 9 cm for 0.1 degrees."""
FEWEST: Final = 3
_ITERATIONS: Final = 8
_NEAREST_M: Final = 1e-6
_SINGULAR: Final = 1e-12


class Covariance(NamedTuple):
    """Of x, y [m] and heading t [rad]."""

    xx: float
    xy: float
    yy: float
    xt: float
    yt: float
    tt: float

    @property
    def position_m(self) -> float:
        """Standard deviation of the position."""
        return math.sqrt(max(0.0, self.xx + self.yy))

    def scaled(self, factor: float) -> Covariance:
        """All entries times a factor."""
        return Covariance(*(factor * entry for entry in self))

    def carried(self, dx_m: float, dy_m: float) -> Covariance:
        """That of a pose which lies rigidly by (dx, dy) from this one."""
        xx, xy, yy, xt, yt, tt = self
        return Covariance(
            xx - 2 * dy_m * xt + dy_m * dy_m * tt,
            xy + dx_m * xt - dy_m * yt - dx_m * dy_m * tt,
            yy + 2 * dx_m * yt + dx_m * dx_m * tt,
            xt - dy_m * tt,
            yt + dx_m * tt,
            tt,
        )


class Fix(NamedTuple):
    """A pose from bearings alone.

    Attributes:
        pose: of the scanner.
        unit: its covariance for bearings with a standard deviation of 1 rad; its position is the dilution [m/rad].
        residual_rad: largest difference between a bearing and what the pose makes of it.
    """

    pose: Pose
    unit: Covariance
    residual_rad: float


def composed(pose: Pose, relative: Pose) -> Pose:
    """The pose that is ``relative`` to a pose."""
    cos, sin = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return Pose(
        pose.x_m + cos * relative.x_m - sin * relative.y_m,
        pose.y_m + sin * relative.x_m + cos * relative.y_m,
        pose.yaw_rad + relative.yaw_rad,
    )


def inverted(pose: Pose) -> Pose:
    """The origin as seen from a pose."""
    cos, sin = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return Pose(-cos * pose.x_m - sin * pose.y_m, sin * pose.x_m - cos * pose.y_m, -pose.yaw_rad)


def bearing(pose: Pose, reflector: Point) -> float:
    """Bearing to a reflector [rad], within half a turn."""
    return wrap(math.atan2(reflector[1] - pose.y_m, reflector[0] - pose.x_m) - pose.yaw_rad)


def bearing_row(pose: Pose, reflector: Point) -> Row | None:
    """Change of a bearing with x, y and heading; None at the reflector itself."""
    dx, dy = reflector[0] - pose.x_m, reflector[1] - pose.y_m
    squared = dx * dx + dy * dy
    return None if squared < _NEAREST_M * _NEAREST_M else (dy / squared, -dx / squared, -1.0)


def triangulated(sightings: Sequence[Sighting], max_dilution_m_rad: float = MAX_DILUTION_M_RAD) -> Fix | None:
    """The pose from bearings to three or more reflectors.

    Args:
        sightings: each reflector once.
        max_dilution_m_rad: a pose whose dilution is larger is none.

    Returns:
        None where there are fewer than three, or where they do not tell the pose: on or near the circle through all
        reflectors, or in one line with them.
    """
    starts = [start for three in combinations(sightings, FEWEST) if (start := _solved(three)) is not None]
    fixes = [fix for start in starts if (fix := _fitted(start, sightings)) is not None]
    best = min(fixes, key=lambda fix: fix.residual_rad, default=None)
    return best if best is not None and best.unit.position_m <= max_dilution_m_rad else None


def _solved(three: Sequence[Sighting]) -> Pose | None:
    """The pose from three bearings; None where the rows depend on each other."""
    rows = []
    for (x, y), angle in three:
        cos, sin = math.cos(angle), math.sin(angle)
        rows.append((sin * x - cos * y, cos * x + sin * y, -sin, -cos))
    cos, sin, u, w = (_cofactor(rows, column) for column in range(4))
    length = math.hypot(cos, sin)
    if length < _SINGULAR:
        return None
    cos, sin, u, w = cos / length, sin / length, u / length, w / length
    pose = Pose(u * cos + w * sin, u * sin - w * cos, math.atan2(sin, cos))
    ahead = sum(math.cos(bearing(pose, place) - angle) for place, angle in three)
    return pose if ahead > 0 else Pose(pose.x_m, pose.y_m, wrap(pose.yaw_rad + math.pi))


def _cofactor(rows: Sequence[tuple[float, float, float, float]], column: int) -> float:
    """Signed determinant of the rows without a column: an entry of their null vector."""
    (a, b, c), (d, e, f), (g, h, i) = ([value for k, value in enumerate(row) if k != column] for row in rows)
    determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    return -determinant if column % 2 else determinant


def _fitted(pose: Pose, sightings: Sequence[Sighting]) -> Fix | None:
    """The least-squares pose from a near one; None where it is not determined."""
    unit = _unit_covariance(pose, sightings)
    for _ in range(_ITERATIONS):
        if unit is None:
            return None
        rows = [row for place, _ in sightings if (row := bearing_row(pose, place)) is not None]
        dx, dy, turn = least_squares(rows, [wrap(angle - bearing(pose, place)) for place, angle in sightings])
        pose = Pose(pose.x_m + dx, pose.y_m + dy, wrap(pose.yaw_rad + turn))
        unit = _unit_covariance(pose, sightings)
    if unit is None:
        return None
    residual = max(abs(wrap(angle - bearing(pose, place))) for place, angle in sightings)
    return Fix(pose, unit, residual)


def _unit_covariance(pose: Pose, sightings: Sequence[Sighting]) -> Covariance | None:
    """Covariance for bearings with a standard deviation of 1 rad; None where they do not determine the pose."""
    rows = [bearing_row(pose, place) for place, _ in sightings]
    seen = [row for row in rows if row is not None]
    return _inverse(seen) if len(seen) == len(rows) and math.isfinite(pose.x_m + pose.y_m + pose.yaw_rad) else None


def _inverse(rows: Sequence[Row]) -> Covariance | None:
    """Inverse of the rows' normal matrix; None where it is singular."""
    aa, ab, ac, bb, bc, cc, determinant, diagonal = normal(rows)
    if determinant <= _SINGULAR * max(diagonal, _SINGULAR):
        return None
    return Covariance(aa, ab, bb, ac, bc, cc).scaled(1 / determinant)
