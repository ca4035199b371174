"""Fitting driven paths into lines and arcs: known paths are found again, anything else within the tolerance.

``Path`` refuses pieces that do not join, or join with a kink.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.loops.odometry import Pose
from daemon.loops.path import Path, Piece, wrap
from daemon.loops.path_fitting import deviation, fit_pieces, split_runs


def driven(pieces: Sequence[Piece], step_m: float = 0.02) -> list[Pose]:
    """Poses along pieces, as a record has them."""
    poses: list[Pose] = []
    for piece in pieces:
        count = max(1, round(piece.length_m / step_m))
        ways = [piece.length_m * index / count for index in range(count + 1)]
        poses += [Pose(*piece.point(way), piece.heading(way)) for way in ways]
    return poses


def chain(*ways: tuple[float, float], backward: bool = False) -> list[Piece]:
    """Pieces of these lengths and curvatures, one after the other."""
    pieces, x, y, direction = [], 0.0, 0.0, 0.0
    for length, curvature in ways:
        piece = Piece(x, y, direction, length, curvature, backward)
        pieces.append(piece)
        (x, y), direction = piece.point(length), piece.direction(length)
    return pieces


@pytest.mark.parametrize("backward", [False, True])
def test_a_line_an_arc_and_a_line_are_found_again(backward: bool) -> None:
    pieces = chain((2.0, 0.0), (1.5, 0.8), (1.0, 0.0), backward=backward)
    found = fit_pieces(driven(pieces), 0.005, backward)
    assert deviation(driven(pieces), found) <= 0.005
    Path(found)
    assert len(found) <= 5
    assert math.fsum(piece.length_m for piece in found) == pytest.approx(4.5, abs=0.01)
    assert all(piece.backward is backward for piece in found)


def test_a_straight_record_is_one_line() -> None:
    (found,) = fit_pieces(driven(chain((3.0, 0.0))), 0.005)
    assert (found.length_m, found.curvature) == pytest.approx((3.0, 0.0), abs=1e-6)


def test_a_circle_is_found_with_its_radius() -> None:
    found = fit_pieces(driven(chain((2 * math.pi, 1.0))), 0.002)
    assert all(piece.curvature == pytest.approx(1.0, abs=0.01) for piece in found if piece.length_m > 0.1)


@given(
    st.lists(st.tuples(st.floats(0.3, 2.0), st.floats(-1.5, 1.5)), min_size=1, max_size=5),
    st.sampled_from([0.002, 0.01, 0.05]),
)
def test_any_path_is_fitted_within_the_tolerance_and_without_kinks(
    ways: list[tuple[float, float]], tolerance: float
) -> None:
    poses = driven(chain(*ways))
    found = fit_pieces(poses, tolerance)
    assert deviation(poses, found) <= tolerance
    Path(found)
    last = found[-1]
    assert math.dist(last.point(last.length_m), (poses[-1].x_m, poses[-1].y_m)) < 0.005
    assert abs(wrap(last.heading(last.length_m) - poses[-1].yaw_rad)) < math.radians(0.5)


def test_a_record_with_noise_is_fitted_with_few_pieces() -> None:
    chance = random.Random(4)
    poses = [
        Pose(
            pose.x_m + chance.gauss(0, 0.001), pose.y_m + chance.gauss(0, 0.001), pose.yaw_rad + chance.gauss(0, 0.002)
        )
        for pose in driven(chain((2.0, 0.0), (1.5, 0.8), (1.0, 0.0)), 0.05)
    ]
    found = fit_pieces(poses, 0.015)
    assert deviation(poses, found) <= 0.015
    assert len(found) <= 12


def test_a_record_is_split_where_the_driving_direction_changes() -> None:
    forward, back = chain((1.0, 0.0)), [Piece(1.0, 0.0, math.pi, 1.5, 0.0, True)]
    still = [Pose(1.0, 0.0)] * 20
    poses = driven(forward) + still + driven(back)
    runs = split_runs(poses)
    assert [backward for backward, _ in runs] == [False, True]
    assert poses[runs[1][1][0]].x_m == pytest.approx(1.0, abs=0.025)


def test_a_record_of_a_vehicle_that_stands_has_no_runs() -> None:
    assert split_runs([Pose(0.001 * (i % 2)) for i in range(50)]) == []
