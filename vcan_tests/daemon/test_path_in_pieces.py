"""Paths in pieces: steering for a piece, and the plan for a path, against kinematics and dense sampling."""

from __future__ import annotations

import math
from itertools import pairwise

import msgspec
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from canhelm.errors import LimitExceeded
from daemon.loops.geometry import solve_turning
from daemon.loops.odometry import Pose
from daemon.loops.paired_steer_piece import DrivenPiece, aimed, bow, steered, target_of
from daemon.loops.path import Path, Piece, arc, line
from daemon.loops.path_in_pieces import MAX_SWEEP_RAD, NEAR_M, SAME_M, PiecePlanner
from profiles.loader import load
from profiles.schema import PairedSteerGeometry

PROFILE = load("max2d").profile
assert isinstance(PROFILE.vehicle, PairedSteerGeometry)
GEOMETRY, LIMITS = PROFILE.vehicle, PROFILE.limits
directions = st.floats(-math.pi, math.pi)
curvatures = st.floats(0.05, 1.9) | st.floats(-1.9, -0.05)


def planned(path: Path, yaw_rad: float = 0.0) -> list[DrivenPiece]:
    return [driven for driven in PiecePlanner(GEOMETRY, LIMITS, path, yaw_rad) if driven is not None]


def chained(bends: list[tuple[float, float]], start: Piece | None = None) -> Path:
    """Pieces of (length, curvature) that join."""
    pieces = [] if start is None else [start]
    x, y, direction = (0.0, 0.0, 0.0)
    for length, curvature in bends:
        piece = Piece(x, y, direction, length, curvature)
        pieces.append(piece)
        (x, y), direction = piece.point(length), piece.direction(length)
    return Path(pieces)


def sampled(piece: Piece, begin: float, end: float, count: int = 400) -> np.ndarray:
    return np.array([piece.point(along) for along in np.linspace(begin, end, count)])


def nearest(points: np.ndarray, driven: Piece) -> np.ndarray:
    """Distance of each point from a driven piece, by brute force."""
    others = sampled(driven, 0.0, driven.length_m, 100 + int(500 * driven.length_m))
    gaps = points[:, None, :] - others[None, :, :]
    return np.asarray(np.sqrt((gaps**2).sum(axis=2).min(axis=1)))


# --- steering for one piece ------------------------------------------------------------------------------------------


@given(directions, curvatures)
def test_the_headings_turn_the_robot_about_the_centre_of_the_arc(direction: float, curvature: float) -> None:
    headings = steered(GEOMETRY, LIMITS, direction, curvature)
    assume(headings is not None)
    assert headings is not None
    centre = (-math.sin(direction) / curvature, math.cos(direction) / curvature)
    motion = solve_turning(GEOMETRY, headings.rear_rad, headings.front_rad, headings.sense * 0.5)
    assert motion.icr_m == pytest.approx(centre, abs=1e-6)
    assert motion.yaw_rate_rad_s == pytest.approx(0.5 * curvature)


@given(directions)
def test_a_line_goes_in_its_direction(direction: float) -> None:
    headings = steered(GEOMETRY, LIMITS, direction, 0.0)
    assume(headings is not None)
    assert headings is not None
    assert headings.rear_rad == headings.front_rad
    way = headings.sense * np.array([math.cos(headings.rear_rad), math.sin(headings.rear_rad)])
    assert way == pytest.approx(np.array([math.cos(direction), math.sin(direction)]))


@pytest.mark.parametrize(("direction_deg", "curvature"), [(90.0, 0.0), (-88.0, 0.0), (0.0, 4.0), (80.0, 1.5)])
def test_what_cannot_be_steered_is_none(direction_deg: float, curvature: float) -> None:
    assert steered(GEOMETRY, LIMITS, math.radians(direction_deg), curvature) is None


@given(st.floats(-2.0, 2.0))
def test_a_bow_ends_at_its_end_and_turns_by_its_sweep(sweep: float) -> None:
    piece = bow((1.0, 2.0), (1.5, 1.0), sweep)
    assert piece.point(piece.length_m) == pytest.approx((1.5, 1.0))
    assert piece.curvature * piece.length_m == pytest.approx(sweep, abs=1e-8)


def test_from_beside_an_arc_the_next_piece_still_ends_where_and_as_planned() -> None:
    plan = DrivenPiece(Piece(0.0, 0.0, 0.0, 1.0, 1.0), 0.0, 0, 0, 0.0)
    piece = aimed(GEOMETRY, LIMITS, plan, Pose(0.02, -0.01, 0.05))
    assert piece is not None
    assert (piece.end.x_m, piece.end.y_m) == pytest.approx((plan.end.x_m, plan.end.y_m))
    assert piece.end.yaw_rad == pytest.approx(plan.end.yaw_rad)


def test_from_beside_a_line_the_next_piece_ends_where_planned_and_the_yaw_stays() -> None:
    plan = DrivenPiece(Piece(0.0, 0.0, 0.3, 1.0), 0.0, 0, 0, 0.0)
    piece = aimed(GEOMETRY, LIMITS, plan, Pose(0.02, -0.01, 0.05))
    assert piece is not None
    assert (piece.end.x_m, piece.end.y_m) == pytest.approx((plan.end.x_m, plan.end.y_m))
    assert piece.end.yaw_rad == 0.05


def test_the_speed_on_an_arc_is_what_its_fastest_wheel_may_do() -> None:
    plan = DrivenPiece(Piece(0.0, 0.0, 0.0, 1.0, 1.8), 0.0, 0, 0, 0.0)
    slow = msgspec.structs.replace(LIMITS, wheel_speed_m_s=0.5)
    target = target_of(GEOMETRY, slow, plan, 1.0)
    assert target.rear_heading_rad is not None
    assert target.front_heading_rad is not None
    motion = solve_turning(GEOMETRY, target.rear_heading_rad, target.front_heading_rad, target.speed_m_s)
    assert max(map(abs, motion.roll_speed_m_s)) == pytest.approx(0.5)


# --- the plan --------------------------------------------------------------------------------------------------------

bends = st.lists(st.tuples(st.floats(0.05, 1.5), st.just(0.0) | st.floats(-4.0, 4.0)), min_size=1, max_size=6)


@given(bends)
@settings(max_examples=60, deadline=None)
def test_the_pieces_join_cover_the_path_and_end_at_its_end(shape: list[tuple[float, float]]) -> None:
    path = chained(shape)
    plan = planned(path)
    for before, after in pairwise(plan):
        assert (after.piece.x_m, after.piece.y_m) == pytest.approx((before.end.x_m, before.end.y_m), abs=1e-9)
        assert after.yaw_rad == pytest.approx(before.end.yaw_rad)
        assert after.first in (before.last, before.last + 1)
    assert (plan[0].first, plan[-1].last) == (0, len(path.pieces) - 1)
    last = path.pieces[-1]
    assert (plan[-1].end.x_m, plan[-1].end.y_m) == pytest.approx(last.point(last.length_m), abs=1e-9)


@given(bends)
@settings(max_examples=60, deadline=None)
def test_every_piece_can_be_steered_with_something_to_spare(shape: list[tuple[float, float]]) -> None:
    for driven in planned(chained(shape)):
        direction = driven.piece.direction_rad - driven.yaw_rad
        assert steered(GEOMETRY, LIMITS, direction + math.radians(1), driven.piece.curvature) is not None


@given(bends)
@settings(max_examples=25, deadline=None)
def test_the_stated_deviation_is_what_dense_sampling_finds(shape: list[tuple[float, float]]) -> None:
    """A piece that stands for whole pieces of the path, and pieces that share one: the largest of theirs."""
    path = chained(shape)
    plan = planned(path)
    number = 0
    while number < len(path.pieces):
        mine = [driven for driven in plan if driven.first <= number <= driven.last]
        last = mine[-1].last
        points = np.concatenate([sampled(p, 0.0, p.length_m, 150) for p in path.pieces[number : last + 1]])
        near = np.min([nearest(points, driven.piece) for driven in mine], axis=0)
        stated = max(driven.deviation_m for driven in mine)
        assert near.max() <= stated + 0.003
        if len(mine) == 1:
            assert near.max() == pytest.approx(stated, abs=0.003)
        number = last + 1


@given(bends)
@settings(max_examples=40, deadline=None)
def test_no_piece_is_farther_from_the_path_than_the_tolerance(shape: list[tuple[float, float]]) -> None:
    assert max(driven.deviation_m for driven in planned(chained(shape))) <= NEAR_M


@given(st.floats(0.2, 1.2), curvatures)
@settings(max_examples=40, deadline=None)
def test_the_arc_is_chosen_where_it_is_nearer_than_the_line(length: float, curvature: float) -> None:
    assume(length * abs(curvature) < MAX_SWEEP_RAD)
    path = chained([(length, curvature)])
    plan = planned(path)
    if steered(GEOMETRY, LIMITS, 0.0, curvature, math.radians(1.5)) is not None:
        assert len(plan) == 1
        assert plan[0].piece.curvature == curvature
        chord = line((0.0, 0.0), path.pieces[0].point(length))
        assert nearest(sampled(path.pieces[0], 0.0, length), chord).max() > plan[0].deviation_m


def test_lines_and_arcs_that_can_be_steered_are_driven_as_they_are() -> None:
    path = chained([(1.0, 0.0), (1.0, 1.25), (0.5, 0.0), (1.0, -1.0)])
    plan = planned(path)
    assert [driven.piece.curvature for driven in plan] == [0.0, 1.25, 0.0, -1.0]
    assert max(driven.deviation_m for driven in plan) < 1e-9


def test_a_bend_too_narrow_to_be_steered_becomes_lines_at_angles() -> None:
    plan = planned(chained([(0.3, 5.0)]))
    assert len(plan) > 1
    assert all(driven.piece.curvature == 0 for driven in plan)
    assert plan[-1].end.yaw_rad == 0.0


def test_a_way_straight_to_the_side_becomes_legs_beside_it() -> None:
    plan = planned(Path([Piece(0.0, 0.0, math.pi / 2, 0.5)]))
    assert len(plan) > 1
    assert plan[-1].end.y_m == pytest.approx(0.5)
    assert 0 < max(driven.deviation_m for driven in plan) <= NEAR_M


def test_many_short_pieces_are_driven_in_few() -> None:
    plan = planned(chained([(0.01, 0.5 * math.sin(number / 50)) for number in range(400)]))
    assert len(plan) < 20
    assert max(driven.deviation_m for driven in plan) <= SAME_M


def test_a_whole_circle_has_stops_at_which_its_place_is_put_right() -> None:
    plan = planned(Path([arc((0.0, 1.0), 1.0, -math.pi / 2, math.tau)]))
    assert len(plan) >= 3
    assert max(driven.deviation_m for driven in plan) < 1e-9


def test_no_piece_goes_round_the_turn_between_two_driving_directions() -> None:
    path = Path([Piece(0.0, 0.0, 0.0, 1.0), Piece(1.0, 0.0, math.pi, 0.5, 0.0, backward=True)])
    plan = planned(path)
    assert [(driven.first, driven.last) for driven in plan] == [(0, 0), (1, 1)]
    assert target_of(GEOMETRY, LIMITS, plan[1], 0.5).speed_m_s == -0.5


def test_a_path_that_steering_cannot_stay_near_is_refused_with_its_piece() -> None:
    narrow = msgspec.structs.replace(LIMITS, heading_deg=5.0)
    path = chained([(1.0, 0.0), (1.0, 3.0)])
    with pytest.raises(LimitExceeded, match="piece 1") as refusal:
        list(PiecePlanner(GEOMETRY, narrow, path, 0.0))
    assert refusal.value.object == "piece 1"
