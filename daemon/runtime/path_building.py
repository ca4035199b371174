"""From the pieces of a path file to the path that a law follows."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Iterable
from typing import TypeVar

from canhelm.errors import CanhelmError, UsageError
from daemon.loops.odometry import Pose
from daemon.loops.path import Path, Piece, check_piece, check_run_out, join_waypoints
from profiles.path_file import PathSpec, PieceSpec, Point

PIECES_AT_A_TIME = 100
"""So many pieces are built in a millisecond or two; then everybody else has a turn."""
_KINDS = ("line_m", "line_to_m", "arc_deg", "waypoints_m")

E = TypeVar("E", bound=CanhelmError)


class PathBuilder:
    """Adds the pieces of a file to a path, one by one.

    Args:
        start: of the vehicle's reference point, with the vehicle's heading.
        lead_m: as for :class:`daemon.loops.path.Path`.
        exchanged: drive backward what the file says is driven forward, and the other way round.
        forward_curvature, backward_curvature: as for :func:`daemon.loops.path.check_piece`.
        from_here: the file says no start; where a joint is wrong, it is told what that means for points.
        entry: number of the first piece that is added, for errors.
    """

    def __init__(
        self,
        start: Pose,
        lead_m: float,
        exchanged: bool,
        forward_curvature: float,
        backward_curvature: float,
        *,
        from_here: bool = False,
        entry: int = 0,
    ) -> None:
        self._from_here = from_here
        self._x_m, self._y_m, self._heading_rad = start.x_m, start.y_m, start.yaw_rad
        self._lead_m, self._exchanged = lead_m, exchanged
        self._curvatures = forward_curvature, backward_curvature
        self._backward = exchanged
        self._path: Path | None = None
        self._entries = entry

    @property
    def end(self) -> Pose:
        """Where the next piece begins, with the vehicle's heading."""
        return Pose(self._x_m, self._y_m, self._heading_rad)

    @property
    def backward(self) -> bool:
        """Driving direction of the last piece."""
        return self._backward

    def add(self, spec: PieceSpec) -> None:
        """Add one piece of the file.

        Raises:
            UsageError: it is no piece, or does not join; ``object`` is its ``pieces[number]``.
            LimitExceeded: it is more than the vehicle can do; likewise.
        """
        try:
            for piece in self._pieces(spec):
                check_piece(self._entries, piece, *self._curvatures)
                if self._path is None:
                    self._path = Path([piece], self._lead_m)
                else:
                    self._path.append(piece, self._entries)
        except CanhelmError as error:
            stray = self._from_here and isinstance(error, UsageError) and error.limit is not None and _has_points(spec)
            raise _of_entry(_in_frame(error) if stray else error, self._entries) from None
        self._entries += 1
        self._go_to_end()

    def finished(self, run_out_m: float) -> Path:
        """The path. Raises UsageError where it is empty, LimitExceeded as :func:`check_run_out`."""
        if self._path is None:
            raise UsageError("the path is empty", remedy="give it at least one line or arc")
        try:
            check_run_out(self._path, run_out_m)
        except CanhelmError as error:
            number = int((error.object or "piece 0").removeprefix("piece "))
            raise _of_entry(error, number) from None
        return self._path

    def _go_to_end(self) -> None:
        assert self._path is not None
        piece = self._path.pieces[-1]
        (self._x_m, self._y_m), self._heading_rad = piece.point(piece.length_m), piece.heading(piece.length_m)
        self._backward = piece.backward

    def _pieces(self, spec: PieceSpec) -> Iterable[Piece]:
        if sum(getattr(spec, kind) is not None for kind in _KINDS) != 1:
            raise self._no_kind(spec)
        self._turn_round(spec)
        x, y = spec.from_m or (self._x_m, self._y_m)
        direction = self._heading_rad + (math.pi if self._backward else 0.0)
        if spec.line_m is not None:
            return (Piece(x, y, direction, spec.line_m, 0.0, self._backward),)
        if spec.line_to_m is not None:
            dx, dy = spec.line_to_m[0] - x, spec.line_to_m[1] - y
            return (Piece(x, y, math.atan2(dy, dx), math.hypot(dx, dy), 0.0, self._backward),)
        if spec.arc_deg is not None:
            return (self._arc(spec, (x, y), direction, math.radians(spec.arc_deg)),)
        return self._through(spec, (x, y))

    def _no_kind(self, spec: PieceSpec) -> UsageError:
        given = " and ".join(kind for kind in _KINDS if getattr(spec, kind) is not None) or "none of its kinds"
        return UsageError(f"piece {self._entries} has {given}", remedy=f"give it one of {', '.join(_KINDS)}")

    def _turn_round(self, spec: PieceSpec) -> None:
        """Change the driving direction: the reference point is another one then."""
        if spec.drive is None:
            return
        backward = (spec.drive == "backward") != self._exchanged
        if self._path is not None:
            lead = self._lead_m * (self._backward - backward)
            self._x_m += lead * math.cos(self._heading_rad)
            self._y_m += lead * math.sin(self._heading_rad)
        self._backward = backward

    def _arc(self, spec: PieceSpec, begin: Point, direction: float, turn: float) -> Piece:
        if (spec.radius_m is None) == (spec.centre_m is None):
            raise _half_told_arc(self._entries, spec)
        radius = spec.radius_m
        if radius is None and spec.centre_m is not None:
            out = math.atan2(begin[1] - spec.centre_m[1], begin[0] - spec.centre_m[0])
            radius, direction = math.dist(begin, spec.centre_m), out + math.copysign(math.pi / 2, turn)
        if not radius:
            raise UsageError(f"piece {self._entries}: an arc begins at its own centre", remedy="check centre_m")
        return Piece(*begin, direction, radius * abs(turn), math.copysign(1 / radius, turn), self._backward)

    def _through(self, spec: PieceSpec, begin: Point) -> list[Piece]:
        if spec.radius_m is None:
            what = f"piece {self._entries}: waypoints_m without the radius of their corners"
            raise UsageError(what, remedy="add radius_m to the piece, such as radius_m: 1")
        points = [begin, *(spec.waypoints_m or ())]
        return join_waypoints(points, spec.radius_m, self._backward, self._lead_m).pieces


def _of_entry(error: E, entry: int) -> E:
    where = f"piece {entry}"
    message = error.message if where in error.message else f"{where}: {error.message}"
    return type(error)(message, object=f"pieces[{entry}]", value=error.value, limit=error.limit, remedy=error.remedy)


def _has_points(spec: PieceSpec) -> bool:
    return any(point is not None for point in (spec.from_m, spec.line_to_m, spec.centre_m, spec.waypoints_m))


def _in_frame(error: E) -> E:
    """The same error of a joint, for a file without a start."""
    message = f"{error.message}; points count in the frame of `canhelm status`, and the file has no start:"
    remedy = f"{error.remedy}, or add start: to the file"
    return type(error)(message, object=error.object, value=error.value, limit=error.limit, remedy=remedy)


def _half_told_arc(entry: int, spec: PieceSpec) -> UsageError:
    where = f"piece {entry}: arc_deg {spec.arc_deg:g}"
    if spec.radius_m is None:
        remedy = "add radius_m or centre_m to the piece, such as radius_m: 1"
        return UsageError(f"{where} has neither radius_m nor centre_m", remedy=remedy)
    return UsageError(f"{where} has both radius_m and centre_m", remedy="leave one of them out")


async def build_path(
    spec: PathSpec,
    here: Pose,
    *,
    lead_m: float = 0.0,
    exchanged: bool = False,
    forward_curvature: float,
    backward_curvature: float,
    run_out_m: float,
) -> Path:
    """The path of a file, for one vehicle; lets the control cycle run while it works.

    Args:
        spec: what the file says.
        here: where the vehicle's reference point is: where a path without a start begins.
        lead_m, exchanged: as for :class:`PathBuilder`.
        forward_curvature, backward_curvature: as for :func:`daemon.loops.path.check_piece`.
        run_out_m: shortest section.

    Raises:
        UsageError: the path is empty, a piece is none, or does not begin where the one before it ends.
        LimitExceeded: a radius is too small or a section too short. Both have ``pieces[number]`` as their object.
    """
    start = spec.start
    pose = here if start is None else Pose(start.x_m, start.y_m, math.radians(start.heading_deg))
    builder = PathBuilder(pose, lead_m, exchanged, forward_curvature, backward_curvature, from_here=start is None)
    for number, piece in enumerate(spec.pieces, start=1):
        builder.add(piece)
        if number % PIECES_AT_A_TIME == 0:
            await asyncio.sleep(0)
    return builder.finished(run_out_m)
