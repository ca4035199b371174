"""Paths of straight lines and circular arcs: pieces, their joints, waypoints, checks.

A piece has a direction of travel; the vehicle's heading is that direction or, on a piece that is driven backwards, its
opposite. Pieces that follow each other in one driving direction are a section; between sections the vehicle stops.
The path is that of the vehicle's reference point: forwards the truck's rear axle, backwards the last axle.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

from canhelm.errors import LimitExceeded, UsageError
from profiles.parts import Part

Point = tuple[float, float]

STRAIGHT: Final = 1e-9
"""Curvature [1/m] below which a piece is a line: a bow of half a millimetre in a kilometre."""
MAX_GAP_M: Final = 0.005
MAX_KINK_RAD: Final = math.radians(0.5)
LONGEST_M: Final = 10_000.0
"""Of one piece: nobody means more, and places stay exact to a thousandth of a millimetre."""
_AT_CENTRE_M: Final = 1e-9
_ROUNDING_M: Final = 1e-9


class Meeting(NamedTuple):
    """The point of a path that a vehicle is at.

    Attributes:
        piece: its number, from 0.
        along_m: way from the piece's beginning; beyond both ends on their extension.
        offset_m: of the vehicle to the left of travel.
    """

    piece: int
    along_m: float
    offset_m: float


def wrap(angle_rad: float) -> float:
    """The same angle within half a turn."""
    return math.remainder(angle_rad, math.tau)


class Piece(Part, frozen=True, gc=False):
    """A straight line or a circular arc; a hundred thousand of them cost the collector of garbage nothing.

    Attributes:
        x_m, y_m: beginning.
        direction_rad: of travel, there.
        length_m: infinite for a line or circle without end.
        curvature: positive bends to the left of travel [1/m]; 0 is a line.
        backward: the vehicle drives backwards.
    """

    x_m: float
    y_m: float
    direction_rad: float
    length_m: float
    curvature: float = 0.0
    backward: bool = False

    @property
    def heading_curvature(self) -> float:
        """Curvature as the vehicle sees it: positive when the centre is to the left of its heading."""
        return -self.curvature if self.backward else self.curvature

    def direction(self, along_m: float) -> float:
        """Direction of travel, not wrapped."""
        return self.direction_rad + self.curvature * along_m

    def heading(self, along_m: float) -> float:
        """Heading of the vehicle, not wrapped."""
        return self.direction(along_m) + (math.pi if self.backward else 0.0)

    def point(self, along_m: float) -> Point:
        """The point ``along_m`` from the beginning, also before it and beyond the end."""
        half = self.curvature * along_m / 2
        chord = along_m * math.sin(half) / half if half else along_m
        direction = self.direction_rad + half
        return (self.x_m + chord * math.cos(direction), self.y_m + chord * math.sin(direction))

    def centre(self) -> Point:
        """Centre of the arc.

        Raises:
            ZeroDivisionError: the piece is a line.
        """
        radius = 1 / self.curvature
        return (self.x_m - radius * math.sin(self.direction_rad), self.y_m + radius * math.cos(self.direction_rad))

    def project(self, x_m: float, y_m: float, near_m: float = 0.0) -> tuple[float, float]:
        """The nearest point of the endless line or of the circle: way from the beginning, offset to the left.

        Args:
            x_m, y_m: the place to look from.
            near_m: on a circle, the way is the one within half a turn of this; at its centre, it is this.
        """
        if abs(self.curvature) < STRAIGHT:
            dx, dy = x_m - self.x_m, y_m - self.y_m
            cos, sin = math.cos(self.direction_rad), math.sin(self.direction_rad)
            return (dx * cos + dy * sin, dy * cos - dx * sin)
        cx, cy = self.centre()
        dx, dy = x_m - cx, y_m - cy
        distance = math.hypot(dx, dy)
        offset = 1 / self.curvature - math.copysign(distance, self.curvature)
        if distance < _AT_CENTRE_M:
            return (near_m, offset)
        direction = math.atan2(dy, dx) + math.copysign(math.pi / 2, self.curvature)
        return (near_m + wrap(direction - self.direction(near_m)) / self.curvature, offset)


def line(start: Point, end: Point, backward: bool = False) -> Piece:
    """The straight way from ``start`` to ``end``."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    return Piece(*start, math.atan2(dy, dx), math.hypot(dx, dy), 0.0, backward)


def arc(centre: Point, radius_m: float, start_rad: float, sweep_rad: float, backward: bool = False) -> Piece:
    """An arc about ``centre`` from the angle ``start_rad`` over ``sweep_rad``, counter-clockwise when positive."""
    sense = math.copysign(1.0, sweep_rad)
    x, y = centre[0] + radius_m * math.cos(start_rad), centre[1] + radius_m * math.sin(start_rad)
    return Piece(x, y, start_rad + sense * math.pi / 2, radius_m * abs(sweep_rad), sense / radius_m, backward)


class Path:
    """Pieces that join.

    Attributes:
        pieces: in the order of travel.
        sections: first and last piece of each section.
        sharpest: highest curvature of a piece [1/m].
    """

    def __init__(self, pieces: Iterable[Piece], lead_m: float = 0.0) -> None:
        """Check that the pieces join.

        Args:
            pieces: in the order of travel.
            lead_m: from the reference point for driving backwards ahead to the one for driving forwards. Where the
                driving direction changes, the path jumps by it: along the heading, the vehicle being straight there.

        Raises:
            UsageError: there is no piece, one has a number that is not finite or no length, or does not begin where
                the one before it ends; ``object`` names the piece.
        """
        self.pieces: Final[list[Piece]] = []
        self.sections: Final[list[tuple[int, int]]] = []
        self.sharpest = 0.0
        self._begin_m: Final[list[float]] = []
        self._numbers: Final[list[int]] = []
        self._lead_m = lead_m
        for piece in pieces:
            self.append(piece)
        if not self.pieces:
            raise UsageError("the path is empty", remedy="give it at least one line or arc")

    def append(self, piece: Piece, told: int | None = None) -> None:
        """Let the path go on by a piece.

        Args:
            piece: the next one.
            told: number by which people know it, where several pieces come from one entry of a file; errors have it.

        Raises:
            UsageError: as the constructor does.
        """
        number = len(self.pieces)
        told = number if told is None else told
        _check_numbers(told, piece)
        if number:
            before = self.pieces[-1]
            if before.length_m == math.inf:
                raise _not_finite(self._numbers[-1])
            _check_joint(self._numbers[-1], told, before, piece, self._lead_m)
        if number and before.backward == piece.backward:
            self.sections[-1] = (self.sections[-1][0], number)
        else:
            self.sections.append((number, number))
        self._begin_m.append(self._begin_m[-1] + before.length_m if number else 0.0)
        self._numbers.append(told)
        self.pieces.append(piece)
        self.sharpest = max(self.sharpest, abs(piece.curvature))

    @property
    def length_m(self) -> float:
        """Length of all pieces [m]."""
        return self._begin_m[-1] + self.pieces[-1].length_m

    def told(self, piece: int) -> int:
        """Number by which people know a piece."""
        return self._numbers[piece]

    def way_to(self, piece: int, along_m: float) -> float:
        """Way from the path's beginning to a point of a piece [m]."""
        return self._begin_m[piece] + along_m

    def section_length(self, section: int) -> float:
        """Length of a section [m]."""
        first, last = self.sections[section]
        return self._begin_m[last] + self.pieces[last].length_m - self._begin_m[first]

    def section_end(self, piece: int) -> int:
        """Last piece of the section that a piece belongs to."""
        return self.sections[bisect_right(self.sections, piece, key=lambda section: section[0]) - 1][1]

    def remaining(self, section: int, piece: int, along_m: float) -> float:
        """Way from a point of a section to the section's end [m]; negative beyond it."""
        last = self.sections[section][1]
        return self._begin_m[last] - self._begin_m[piece] + self.pieces[last].length_m - along_m

    def meet(self, section: int, last: Meeting, x_m: float, y_m: float) -> Meeting:
        """Where the vehicle is, from where it was: on the same piece or on one of those after it."""
        end = self.sections[section][1]
        number, near = last.piece, last.along_m
        while True:
            piece = self.pieces[number]
            along, offset = piece.project(x_m, y_m, near)
            if number == end or along <= piece.length_m:
                return Meeting(number, along, offset)
            number, near = number + 1, 0.0

    def ahead(self, section: int, piece: int, along_m: float) -> tuple[Piece, float]:
        """The piece ``along_m`` beyond the beginning of ``piece``, within the section, and the way on it.

        Beyond the section's end it is the last piece, which goes on as it is.
        """
        at = self._begin_m[piece] + along_m
        number = bisect_right(self._begin_m, at, piece + 1, self.sections[section][1] + 1) - 1
        return self.pieces[number], at - self._begin_m[number]


def _check_numbers(number: int, piece: Piece) -> None:
    numbers = (piece.x_m, piece.y_m, piece.direction_rad, piece.curvature)
    if not all(map(math.isfinite, numbers)) or math.isnan(piece.length_m):
        raise _not_finite(number)
    if piece.length_m <= 0:
        raise UsageError(
            f"piece {number} is {piece.length_m:g} m long", object=f"piece {number}", remedy="leave the piece out"
        )


def _not_finite(number: int) -> UsageError:
    return UsageError(f"piece {number} has a number that is not finite", object=f"piece {number}")


def _check_joint(before_number: int, number: int, before: Piece, piece: Piece, lead_m: float) -> None:
    heading = before.heading(before.length_m)
    x, y = before.point(before.length_m)
    lead = lead_m * (before.backward - piece.backward)
    gap = math.hypot(piece.x_m - x - lead * math.cos(heading), piece.y_m - y - lead * math.sin(heading))
    kink = abs(wrap(piece.direction_rad + (math.pi if piece.backward else 0.0) - heading))
    where = f"piece {number}"
    if gap > MAX_GAP_M:
        message = f"{where} begins {gap:.3f} m beside the end of piece {before_number}"
        remedy = "let each piece begin where the last one ends"
        limit = f"gap_m {MAX_GAP_M:g}"
        raise UsageError(message, object=where, value=round(gap, 4), limit=limit, remedy=remedy)
    if kink > MAX_KINK_RAD:
        kink_deg = math.degrees(kink)
        message = f"the heading jumps by {kink_deg:.1f} degrees at the beginning of {where}"
        limit = f"kink_deg {math.degrees(MAX_KINK_RAD):g}"
        raise UsageError(
            message, object=where, value=round(kink_deg, 3), limit=limit, remedy="join the pieces by an arc"
        )


def check_piece(number: int, piece: Piece, forward_curvature: float, backward_curvature: float) -> None:
    """Refuse a piece that a vehicle cannot follow.

    Args:
        number: by which people know the piece.
        piece: to be driven.
        forward_curvature: highest that the vehicle holds when driving forwards [1/m].
        backward_curvature: likewise backwards; 0 for a vehicle without a reverse gear.

    Raises:
        LimitExceeded: its radius is too small, it is longer than ``LONGEST_M``, or it is driven backwards and may not
            be; ``object`` names the piece.
    """
    limit, where = backward_curvature if piece.backward else forward_curvature, f"piece {number}"
    if piece.backward and limit <= 0:
        message = f"{where} is driven backwards, and the vehicle cannot"
        raise LimitExceeded(message, object=where, remedy="lead the path round forwards")
    if piece.length_m > LONGEST_M:
        message = f"{where} is {piece.length_m:g} m long"
        longest = f"length_m {LONGEST_M:g}"
        raise LimitExceeded(message, object=where, value=piece.length_m, limit=longest, remedy="drive it in parts")
    if abs(piece.curvature) > limit:
        radius, least = 1 / abs(piece.curvature), f"{1 / limit:.3f} m"
        way = "backwards" if piece.backward else "forwards"
        message = f"{where} has a radius of {radius:.3f} m, the vehicle needs {least} {way}"
        raise LimitExceeded(message, object=where, value=round(radius, 4), limit=least, remedy="widen the arc")


def check_run_out(path: Path, run_out_m: float) -> None:
    """Refuse a path with a section that is shorter than ``run_out_m``: a law that looks ahead needs its look-ahead.

    Raises:
        LimitExceeded: ``object`` names the section's last piece.
    """
    for section, (_, last) in enumerate(path.sections):
        length = path.section_length(section)
        if length < run_out_m:
            where = f"piece {path.told(last)}"
            message = f"the way to the end of {where} is {length:.3f} m, too short to be followed"
            least = f"{run_out_m:.3f} m"
            remedy = f"give the section at least {least}"
            raise LimitExceeded(message, object=where, value=round(length, 4), limit=least, remedy=remedy)


def join_waypoints(points: Sequence[Point], radius_m: float, backward: bool = False, lead_m: float = 0.0) -> Path:
    """The path along straight legs through ``points``, their corners rounded.

    Where a leg goes back along the last one, the driving direction changes; the legs after it are those of the other
    reference point, and begin ``lead_m`` from the waypoint.

    Args:
        points: at least two.
        radius_m: of the corners.
        backward: whether the first leg is driven backwards.
        lead_m: as for :class:`Path`.

    Raises:
        UsageError: there are fewer than two waypoints, or two that follow each other are one place.
        LimitExceeded: a leg is too short for the roundings at its ends; ``object`` names the waypoint.
    """
    if len(points) < 2:
        raise UsageError(f"{len(points)} waypoints make no path", remedy="give at least two")
    return Path(_rounded(points, radius_m, backward, lead_m), lead_m)


def _rounded(points: Sequence[Point], radius_m: float, backward: bool, lead_m: float) -> list[Piece]:
    directions = [_direction(number, points) for number in range(1, len(points))]
    pieces: list[Piece] = []
    start_m = 0.0
    for number, direction in enumerate(directions, start=1):
        corner, length = points[number], math.dist(points[number - 1], points[number])
        turn = wrap(directions[number] - direction) if number < len(directions) else 0.0
        cusp = abs(turn) >= math.pi - MAX_KINK_RAD
        cut = 0.0 if cusp else radius_m * math.tan(abs(turn) / 2)
        straight = length - start_m - cut
        if straight < -_ROUNDING_M:
            raise _short_leg(corner, length, length - straight)
        leg = _leg_to(corner, direction, straight, cut, backward)
        if straight > _ROUNDING_M:
            pieces.append(leg)
        if cut > _ROUNDING_M:
            bend = math.copysign(1 / radius_m, turn)
            pieces.append(Piece(*leg.point(straight), direction, radius_m * abs(turn), bend, backward))
        start_m, backward = (lead_m, not backward) if cusp else (cut, backward)
    return pieces


def _leg_to(corner: Point, direction: float, straight_m: float, cut_m: float, backward: bool) -> Piece:
    """The straight part of a leg, that ends ``cut_m`` before the corner."""
    way = straight_m + cut_m
    x, y = corner[0] - way * math.cos(direction), corner[1] - way * math.sin(direction)
    return Piece(x, y, direction, straight_m, 0.0, backward)


def _direction(number: int, points: Sequence[Point]) -> float:
    before, point = points[number - 1], points[number]
    if math.dist(before, point) < MAX_GAP_M:
        where = _waypoint(point)
        raise UsageError(f"{where} is where the one before it is", object=where, remedy="leave it out")
    return math.atan2(point[1] - before[1], point[0] - before[0])


def _short_leg(corner: Point, length_m: float, needed_m: float) -> LimitExceeded:
    where, least = _waypoint(corner), f"{needed_m:.3f} m"
    message = f"the leg to {where} is {length_m:.3f} m long, its ends need {least}"
    remedy = "move the waypoints apart, or round the corners with a smaller radius"
    return LimitExceeded(message, object=where, value=round(length_m, 4), limit=least, remedy=remedy)


def _waypoint(point: Point) -> str:
    return f"waypoint [{point[0]:g}, {point[1]:g}]"
