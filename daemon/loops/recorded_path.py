"""Makes a path of where a vehicle was driven: lines and arcs for each part that goes in one direction."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Final, Literal

import msgspec

from daemon.loops.odometry import Pose
from daemon.loops.path import Piece, wrap
from daemon.loops.path_fitting import deviation, fit_pieces, split_runs
from daemon.loops.record_smoothing import smoothed
from profiles.path_file import PathSpec, PieceSpec, StartSpec

SLIGHTEST_RAD: Final = 1e-5
"""An arc that turns less is written as a line."""
_DIGITS: Final = 5
"""Of metres: a hundredth of a millimetre."""


@dataclass(frozen=True, slots=True)
class Run:
    """A part of a record in one driving direction: poses of its reference point, and the pieces that fit them."""

    poses: Sequence[Pose]
    pieces: Sequence[Piece]


@dataclass(frozen=True, slots=True)
class RecordedPath:
    """What was made of a record.

    Attributes:
        runs: its parts, in the order of travel.
    """

    runs: list[Run]

    @property
    def pieces(self) -> list[Piece]:
        """Of all parts."""
        return [piece for run in self.runs for piece in run.pieces]

    @property
    def length_m(self) -> float:
        """Of all pieces."""
        return math.fsum(piece.length_m for piece in self.pieces)

    @property
    def deviation_m(self) -> float:
        """Largest distance of a recorded pose from the pieces."""
        return max(deviation(run.poses, run.pieces) for run in self.runs)

    def spec(self) -> PathSpec:
        """As a path file has it; the first piece of each part tells the driving direction, and where it begins."""
        first = self.runs[0].pieces[0]
        heading_deg = round(math.degrees(wrap(first.heading(0.0))), _DIGITS)
        start = StartSpec(x_m=round(first.x_m, _DIGITS), y_m=round(first.y_m, _DIGITS), heading_deg=heading_deg)
        parts = (_specs(run, first=number == 0) for number, run in enumerate(self.runs))
        return PathSpec(start=start, pieces=list(chain.from_iterable(parts)))


def fit_record(trucks: Sequence[Pose], trailers: Sequence[Pose], tolerance_m: float) -> RecordedPath | None:
    """The path along a record; None where the vehicle hardly moved.

    Args:
        trucks: poses as recorded, of the reference point for driving forward.
        trailers: likewise backward; the same ones for a vehicle without a trailer.
        tolerance_m: what the path may be off.
    """
    runs = []
    for backward, indices in split_runs(trucks):
        poses = [(trailers if backward else trucks)[index] for index in indices]
        runs.append(Run(poses, fit_pieces(smoothed(poses, tolerance_m), tolerance_m, backward)))
    return RecordedPath(runs) if runs else None


def _specs(run: Run, *, first: bool) -> Iterator[PieceSpec]:
    begin = run.pieces[0]
    place = None if first else (round(begin.x_m, _DIGITS), round(begin.y_m, _DIGITS))
    drive: Literal["forward", "backward"] = "backward" if begin.backward else "forward"
    yield msgspec.structs.replace(_spec(begin), from_m=place, drive=drive)
    for piece in run.pieces[1:]:
        yield _spec(piece)


def _spec(piece: Piece) -> PieceSpec:
    turn = piece.curvature * piece.length_m
    if abs(turn) < SLIGHTEST_RAD:
        return PieceSpec(line_m=round(piece.length_m, _DIGITS))
    return PieceSpec(arc_deg=round(math.degrees(turn), _DIGITS + 1), radius_m=round(1 / abs(piece.curvature), _DIGITS))
