"""Plans how a robot that cannot steer while it rolls follows a path: in pieces, between which it stops and steers.

Every piece is a line at any angle or an arc of fixed steering from one point of the path to another, whichever is
nearer to the path. It covers as much of the path as it can within a tolerance that is below what the robot itself
is accurate to. What can be driven neither as a line nor as an arc (a bend too narrow to be steered, a way straight to
the side) is divided into the fewest parts whose lines stay near.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterable, Iterator
from itertools import pairwise
from typing import Final, NamedTuple

from canhelm.errors import LimitExceeded
from daemon.loops.geometry import clamp
from daemon.loops.motion_profile import ARRIVED_M
from daemon.loops.paired_steer_piece import DrivenPiece, bow, steered
from daemon.loops.path import STRAIGHT, Path, Piece, Point, line, wrap
from profiles.schema import Limits, PairedSteerGeometry

SAME_M: Final = 0.002
"""Deviation for which one piece may stand for several of the path."""
NEAR_M: Final = 0.01
"""Deviation up to which what cannot be driven is divided."""
MAX_PARTS: Final = 2000
MAX_MERGED: Final = 50
MERGED_NEARLY: Final = 1.1
"""How far from the most pieces that one can stand for the search may end."""
MAX_SWEEP_RAD: Final = math.tau / 3
"""Of one arc: the robot's place and yaw are put right at its stops."""
SPARE_RAD: Final = math.radians(1.5)
"""Left to the limits of steering: the robot never stands quite as planned."""


Search = Generator[None, None, list[DrivenPiece]]


class Part(NamedTuple):
    """Part of a piece of the path."""

    number: int
    piece: Piece
    begin_m: float
    end_m: float

    def point(self, share: float) -> Point:
        """The point at a share of its length."""
        return self.piece.point(self.begin_m + share * (self.end_m - self.begin_m))

    def divided(self, count: int) -> list[Part]:
        """Equal parts."""
        step = (self.end_m - self.begin_m) / count
        ends = [self.begin_m + step * number for number in range(count)] + [self.end_m]
        return [Part(self.number, self.piece, begin, end) for begin, end in pairwise(ends)]


def deviation(driven: Piece, parts: Iterable[Part]) -> float:
    """Largest distance of a path's parts from a driven line or arc [m]: at their ends, and where they are parallel."""
    return max(distance(driven, part.piece.point(along)) for part in parts for along in _extremes(driven, part))


def distance(driven: Piece, point: Point) -> float:
    """Distance of a point from a line or arc with ends [m]."""
    along, offset = driven.project(*point, driven.length_m / 2)
    if 0 <= along <= driven.length_m:
        return abs(offset)
    return math.dist(point, driven.point(0.0 if along < 0 else driven.length_m))


def _extremes(driven: Piece, part: Part) -> Iterator[float]:
    """Ways along a part's piece where its distance may be largest."""
    yield part.begin_m
    yield part.end_m
    piece, middle = part.piece, (part.begin_m + part.end_m) / 2
    if abs(driven.curvature) >= STRAIGHT:
        parallel = piece.project(*driven.centre(), middle)[0]
    elif abs(piece.curvature) >= STRAIGHT:
        parallel = middle + wrap(driven.direction_rad - piece.direction(middle)) / piece.curvature
    else:
        return
    half_turn = math.pi / abs(piece.curvature) if abs(piece.curvature) >= STRAIGHT else 0.0
    for along in (parallel - half_turn, parallel, parallel + half_turn):
        if part.begin_m < along < part.end_m:
            yield along


class PiecePlanner:
    """Plans piece after piece; iterate over it.

    Args:
        geometry: the robot.
        limits: of the vehicle.
        path: of the robot's centre.
        yaw_rad: of the robot at the path's beginning.
    """

    def __init__(self, geometry: PairedSteerGeometry, limits: Limits, path: Path, yaw_rad: float) -> None:
        self._geometry, self._limits = geometry, limits
        self._path = path
        self._yaw_rad = yaw_rad
        self._merged = 1

    def __iter__(self) -> Iterator[DrivenPiece | None]:
        """The pieces, in the order of travel; None after each millisecond or two of work that has found none yet.

        Raises:
            LimitExceeded: a piece of the path can in no way be driven; ``object`` names it.
        """
        for first, last in self._path.sections:
            number = first
            while number <= last:
                covered = yield from self._longest(number, last)
                if not covered:
                    covered = yield from self._near(number)
                for driven in covered:
                    self._yaw_rad = driven.end.yaw_rad
                    yield driven
                number = covered[-1].last + 1

    def _whole(self, first: int, last: int) -> list[Part]:
        pieces = self._path.pieces
        return [Part(number, pieces[number], 0.0, pieces[number].length_m) for number in range(first, last + 1)]

    def _longest(self, first: int, last: int) -> Search:
        """One piece for as many of the path's as it can stand for; empty where it cannot even for one."""
        best: list[DrivenPiece] = []
        fitting, failing, size = 0, min(last - first + 1, MAX_MERGED) + 1, self._merged
        while fitting * MERGED_NEARLY + 1 < failing:
            size = min(2 * fitting or size, (fitting + failing) // 2)
            driven = self._fitted(self._whole(first, first + size - 1), self._yaw_rad)
            if driven is not None and driven.deviation_m <= SAME_M:
                best, fitting = [driven], size
            else:
                failing = size
            yield None
        self._merged = max(1, fitting)
        return best

    def _near(self, number: int) -> Search:
        """About the fewest pieces that stay near one of the path's."""
        whole = self._whole(number, number)[0]
        count = 1
        while count <= MAX_PARTS:
            covered = self._covered(whole.divided(count))
            if covered and max(driven.deviation_m for driven in covered) <= NEAR_M:
                return covered
            count += 1 + count // 8
            yield None
        where = f"piece {self._path.told(number)}"
        raise LimitExceeded(
            f"{where} can be driven neither in lines nor in arcs that stay near it",
            object=where,
            limit=f"heading_deg {self._limits.heading_deg:g}",
            remedy="widen its bends, or begin with another heading of the robot",
        )

    def _covered(self, parts: list[Part]) -> list[DrivenPiece]:
        """A piece for each part, or two legs beside it; empty where that is not possible."""
        covered: list[DrivenPiece] = []
        yaw = self._yaw_rad
        for part in parts:
            fitted = self._fitted([part], yaw)
            legs = [fitted] if fitted is not None else self._legs(part, yaw)
            if not legs:
                return []
            covered += legs
            yaw = covered[-1].end.yaw_rad
        return covered

    def _fitted(self, parts: list[Part], yaw: float) -> DrivenPiece | None:
        """The line or the arc from the beginning of the parts to their end that is nearer to them; None for neither."""
        begin, end = parts[0].point(0.0), parts[-1].point(1.0)
        candidates = [line(begin, end)] if math.dist(begin, end) > ARRIVED_M else []
        if len(parts) == 1:
            part = parts[0]
            way = part.end_m - part.begin_m
            if abs(part.piece.curvature) * way <= MAX_SWEEP_RAD:
                direction = part.piece.direction(part.begin_m)
                candidates = [Piece(*begin, direction, way, part.piece.curvature), *candidates]
        elif candidates:
            candidates += _bows(begin, end, parts)
        drivable = [one for one in candidates if self._steerable(one, yaw)]
        if not drivable:
            return None
        off, piece = min(((deviation(one, parts), one) for one in drivable), key=lambda pair: pair[0])
        return DrivenPiece(piece, yaw, parts[0].number, parts[-1].number, off)

    def _legs(self, part: Part, yaw: float) -> list[DrivenPiece]:
        """Two lines by a point beside the part, for a way to the side that no heading reaches."""
        begin, end = part.point(0.0), part.point(1.0)
        chord = line(begin, end)
        if chord.length_m <= ARRIVED_M:
            return []
        aside = wrap(chord.direction_rad - yaw)
        short = math.radians(90 - self._limits.heading_deg) + 2 * SPARE_RAD + abs(abs(aside) - math.pi / 2)
        x, y = chord.point(chord.length_m / 2)
        height, across = chord.length_m / 2 * math.tan(short), chord.direction_rad + math.pi / 2
        corner = (x + height * math.cos(across), y + height * math.sin(across))
        legs = []
        for half, piece in zip(part.divided(2), (line(begin, corner), line(corner, end)), strict=True):
            if not self._steerable(piece, yaw):
                return []
            legs.append(DrivenPiece(piece, yaw, part.number, part.number, deviation(piece, [half])))
        return legs

    def _steerable(self, piece: Piece, yaw: float) -> bool:
        return steered(self._geometry, self._limits, piece.direction_rad - yaw, piece.curvature, SPARE_RAD) is not None


def _bows(begin: Point, end: Point, parts: list[Part]) -> list[Piece]:
    """Arcs between two points: one through the middle of the parts, one that turns by as much as they do."""
    chord = line(begin, end)
    along, offset = chord.project(*parts[len(parts) // 2].point(0.5 if len(parts) % 2 else 0.0))
    through = -2.0 * math.atan2(offset, along) - 2.0 * math.atan2(offset, chord.length_m - along)
    turned = sum(part.piece.curvature * (part.end_m - part.begin_m) for part in parts)
    return [bow(begin, end, clamp(sweep, MAX_SWEEP_RAD)) for sweep in (through, turned)]
