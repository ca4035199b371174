"""Fits a driven path into straight lines and arcs that join without kinks.

Between two recorded poses there is one way of a line and an arc (or an arc and a line) that is tangential to both:
with the point where both tangents cross, the tangents of the arc are equally long, and the line is what is left of the
longer one. Where the tangents do not cross that way, as in an S, two arcs of equal tangents join the poses. From each
pose the fit takes the farthest later one that one of these ways reaches within the tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final

from daemon.loops.odometry import Pose
from daemon.loops.path import Piece, wrap

SHORTEST_M: Final = 0.002
"""A piece that is shorter is left out; what a joint may be off is more."""
SPACING_M: Final = 0.02
"""Poses that are nearer to each other than this tell nothing new."""

Way = tuple[Piece, ...]


def split_runs(poses: Sequence[Pose]) -> list[tuple[bool, list[int]]]:
    """Parts of a record that are driven in one direction.

    Args:
        poses: as recorded, of the truck.

    Returns:
        For each part whether it is driven backwards, and the indices of its poses, at least ``SPACING_M`` apart.
    """
    runs: list[tuple[bool, list[int]]] = []
    last = 0
    for index, pose in enumerate(poses):
        dx, dy = pose.x_m - poses[last].x_m, pose.y_m - poses[last].y_m
        if math.hypot(dx, dy) < SPACING_M:
            continue
        backward = dx * math.cos(pose.yaw_rad) + dy * math.sin(pose.yaw_rad) < 0
        if not runs or runs[-1][0] != backward:
            runs.append((backward, [last]))
        runs[-1][1].append(index)
        last = index
    return runs


def fit_pieces(poses: Sequence[Pose], tolerance_m: float, backward: bool = False) -> list[Piece]:
    """Lines and arcs along one part of a record.

    Args:
        poses: of the reference point, in the order of travel.
        tolerance_m: largest distance of a recorded point from the pieces.
        backward: driving direction.
    """
    turn = math.pi if backward else 0.0
    points = [Pose(pose.x_m, pose.y_m, pose.yaw_rad + turn) for pose in poses]
    pieces: list[Piece] = []
    begin = 0
    while begin + 1 < len(points):
        ways = [_farthest(points, begin, tolerance_m, join) for join in (_line_and_arc, _two_arcs)]
        end, way = max(ways, key=lambda found: found[0])
        pieces += way
        begin = end
    return [Piece(p.x_m, p.y_m, p.direction_rad, p.length_m, p.curvature, backward) for p in pieces]


def deviation(poses: Sequence[Pose], pieces: Sequence[Piece]) -> float:
    """Largest distance of a pose from the nearest of the pieces [m]."""
    return max((min(_distance(piece, pose) for piece in pieces) for pose in poses), default=0.0)


def _farthest(
    points: Sequence[Pose], begin: int, tolerance_m: float, join: Callable[[Pose, Pose], Way | None]
) -> tuple[int, Way]:
    """The last point that a way from ``begin`` reaches within the tolerance, and that way."""
    best, found = begin + 1, join(points[begin], points[begin + 1]) or _chord(points[begin], points[begin + 1])
    step = 1
    while step:
        end = min(best + step, len(points) - 1)
        way = join(points[begin], points[end]) if end > best else None
        if way is not None and deviation(points[begin : end + 1], way) <= tolerance_m:
            best, found, step = end, way, 2 * step
        else:
            step //= 2
    return best, found


def _distance(piece: Piece, pose: Pose) -> float:
    along, offset = piece.project(pose.x_m, pose.y_m, piece.length_m / 2)
    if 0.0 <= along <= piece.length_m:
        return abs(offset)
    return math.dist(piece.point(min(max(along, 0.0), piece.length_m)), (pose.x_m, pose.y_m))


def _chord(begin: Pose, end: Pose) -> Way:
    dx, dy = end.x_m - begin.x_m, end.y_m - begin.y_m
    return (Piece(begin.x_m, begin.y_m, math.atan2(dy, dx), math.hypot(dx, dy)),)


def _line_and_arc(begin: Pose, end: Pose) -> Way | None:
    """A line and an arc, in either order; None where the tangents do not cross between the poses."""
    dx, dy = end.x_m - begin.x_m, end.y_m - begin.y_m
    turn = wrap(end.yaw_rad - begin.yaw_rad)
    sine = math.sin(turn)
    ahead, aside = _in_frame(begin, dx, dy)
    if abs(turn) < 1e-6 or abs(turn) > math.pi / 2:
        straight = abs(turn) < 1e-6 and abs(aside) < 1e-6 and ahead > 0
        return (Piece(begin.x_m, begin.y_m, begin.yaw_rad, ahead),) if straight else None
    to_crossing = ahead - aside * math.cos(turn) / sine
    from_crossing = aside / sine
    if to_crossing <= 0 or from_crossing <= 0:
        return None
    line = to_crossing - from_crossing
    if line >= 0:
        first = Piece(begin.x_m, begin.y_m, begin.yaw_rad, line)
        x, y = first.point(line)
        return _without_stumps(first, _arc_to(Pose(x, y, begin.yaw_rad), (end.x_m, end.y_m)))
    x, y = end.x_m + line * math.cos(end.yaw_rad), end.y_m + line * math.sin(end.yaw_rad)
    return _without_stumps(_arc_to(begin, (x, y)), Piece(x, y, end.yaw_rad, -line))


def _two_arcs(begin: Pose, end: Pose) -> Way | None:
    """Two arcs whose four tangents are equally long; None where the way would go back."""
    dx, dy = end.x_m - begin.x_m, end.y_m - begin.y_m
    ux, uy, vx, vy = math.cos(begin.yaw_rad), math.sin(begin.yaw_rad), math.cos(end.yaw_rad), math.sin(end.yaw_rad)
    along = dx * (ux + vx) + dy * (uy + vy)
    if along <= 0:
        return None
    squared, spread = dx * dx + dy * dy, 2 - 2 * (ux * vx + uy * vy)
    tangent = squared / (along + math.sqrt(along * along + spread * squared))
    joint = (begin.x_m + end.x_m + tangent * (ux - vx)) / 2, (begin.y_m + end.y_m + tangent * (uy - vy)) / 2
    first = _arc_to(begin, joint)
    return first, _arc_to(Pose(*joint, first.direction(first.length_m)), (end.x_m, end.y_m))


def _arc_to(begin: Pose, end: tuple[float, float]) -> Piece:
    """The arc that leaves a pose along its heading and reaches a point ahead of it."""
    ahead, aside = _in_frame(begin, end[0] - begin.x_m, end[1] - begin.y_m)
    half, chord = math.atan2(aside, ahead), math.hypot(ahead, aside)
    length = chord * half / math.sin(half) if abs(half) > 1e-9 else chord
    return Piece(begin.x_m, begin.y_m, begin.yaw_rad, length, 2 * half / length if length else 0.0)


def _in_frame(pose: Pose, dx: float, dy: float) -> tuple[float, float]:
    cos, sin = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return dx * cos + dy * sin, dy * cos - dx * sin


def _without_stumps(*pieces: Piece) -> Way:
    return tuple(piece for piece in pieces if piece.length_m >= SHORTEST_M) or pieces[:1]
