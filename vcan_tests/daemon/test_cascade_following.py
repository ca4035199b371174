"""The cascade that follows paths: what it promises on the thesis' states and on others, and what it keeps to."""

from __future__ import annotations

import math
from statistics import mean

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daemon.campaigns.cases import Law, Outcome, State, following, random_states, thesis_states
from daemon.campaigns.following_runs import cascade_law, drive
from daemon.campaigns.ideal_semitrailer import (
    CIRCLE_BACKWARDS,
    LINE_BACKWARDS,
    SEMITRAILER,
    Errors,
    forwards,
    placed,
)
from daemon.campaigns.workers import drive_batch
from daemon.loops.articulated import ArticulatedVehicle
from daemon.loops.cascade_following import CascadeFollower, CascadeTuning
from daemon.loops.odometry import Pose
from daemon.loops.path import Path, Piece, join_waypoints
from daemon.loops.path_following import Limit

PIECES = [LINE_BACKWARDS, CIRCLE_BACKWARDS, forwards(LINE_BACKWARDS), forwards(CIRCLE_BACKWARDS)]


def driven(law: Law, states: list[State], rate_deg_s: float | None) -> list[Outcome]:
    return [out for _, out in drive_batch(following("test", states, law, rate_deg_s))]


def settling(runs: list[Outcome]) -> list[float]:
    """Settling distances; a run that never settles fails the test."""
    distances = [run.settle_m for run in runs if run.settle_m is not None]
    assert len(distances) == len(runs)
    return distances


def test_on_the_thesis_states_with_a_slow_steering_it_keeps_its_bounds() -> None:
    runs = driven("cascade", thesis_states(), 60)
    distances = settling(runs)
    assert mean(distances) <= 0.95
    assert max(distances) <= 1.85
    assert max(run.worst_heading_deg for run in runs) <= 17.5
    assert max(run.worst_bending_deg for run in runs) <= 32


@pytest.mark.parametrize("rate_deg_m", [200, 230, 400, 1000, None])
def test_it_settles_whatever_the_steerings_rate(rate_deg_m: float | None) -> None:
    settling(driven("cascade", thesis_states(), rate_deg_m and rate_deg_m * 0.2))


@pytest.mark.parametrize("rate_deg_s", [60, None])
def test_from_random_states_it_is_better_than_the_thesis_law(rate_deg_s: float | None) -> None:
    states = random_states(60, seed=62)
    ours, theirs = driven("cascade", states, rate_deg_s), driven("thesis", states, rate_deg_s)
    settling(ours)
    both = [(a, b) for a, b in zip(ours, theirs, strict=True) if b.settle_m is not None]
    assert mean(a.settle_m or 0.0 for a, _ in both) < mean(b.settle_m or 0.0 for _, b in both)
    assert max(a.worst_bending_deg for a, _ in both) < max(b.worst_bending_deg for _, b in both)


@pytest.mark.parametrize("piece", PIECES)
def test_without_error_the_vehicle_stays_on_the_path(piece: Piece) -> None:
    run = drive(cascade_law(piece, 1.0), placed(piece, Errors(), 1.0), piece, 20.0)
    assert run.worst[0] < 1e-4


@pytest.mark.parametrize("piece", PIECES)
@pytest.mark.parametrize("period_s", [0.01, 0.1])
def test_it_settles_in_both_directions_and_at_other_cycles(piece: Piece, period_s: float) -> None:
    plant = placed(piece, Errors(0.15, -0.15), math.radians(60))
    assert drive(cascade_law(piece, math.radians(60)), plant, piece, 20.0, period_s).settle_m is not None


@pytest.mark.parametrize("speed_m_s", [0.02, 0.3])
def test_it_settles_at_other_speeds(speed_m_s: float) -> None:
    plant = placed(LINE_BACKWARDS, Errors(0.15, 0.1), math.radians(60))
    law = cascade_law(LINE_BACKWARDS, math.radians(60))
    assert drive(law, plant, LINE_BACKWARDS, 4 / speed_m_s, speed_m_s=speed_m_s).settle_m is not None


def test_left_and_right_are_alike() -> None:
    runs = []
    for sign in (1, -1):
        errors = Errors(0.1 * sign, 0.05 * sign, -0.1 * sign)
        runs.append(drive(cascade_law(LINE_BACKWARDS), placed(LINE_BACKWARDS, errors), LINE_BACKWARDS, 10.0))
    assert runs[0].position_m == pytest.approx([-value for value in runs[1].position_m], abs=1e-9)


poses = st.tuples(st.floats(-1, 1), st.floats(-1.5, 1.5), st.floats(-3, 3))


@settings(max_examples=200)
@given(st.sampled_from(PIECES), poses, st.floats(-1.5, 1.5), st.floats(-0.55, 0.55), st.floats(-1, 1))
def test_every_command_is_within_its_limits(
    piece: Piece, pose: tuple[float, float, float], bending: float, steering: float, speed: float
) -> None:
    tuning = CascadeTuning()
    step = cascade_law(piece, 1.0)(Pose(*pose), bending, steering, speed)
    assert abs(step.steering_rad) <= SEMITRAILER.max_steering_rad
    assert abs(step.curvature) <= tuning.max_curvature
    assert abs(step.bending_target_rad or 0.0) <= tuning.max_bending_rad
    assert abs(step.heading_target_rad or 0.0) <= tuning.max_approach_rad
    assert (step.limit is Limit.STEERING) == (step.steering_rad != step.wanted_steering_rad)


def test_at_the_centre_of_a_circle_it_still_commands_something() -> None:
    step = cascade_law(CIRCLE_BACKWARDS)(Pose(0.0, 0.0, 0.0), 0.0, 0.0, -0.2)
    assert math.isfinite(step.steering_rad)


def test_the_limits_are_told() -> None:
    law = cascade_law(LINE_BACKWARDS)
    assert law(Pose(0, 0, 0.01), 0.0, 0.0, -0.2).limit is None
    assert law(Pose(0, 0.2, 0.0), 0.0, 0.0, -0.2).limit is Limit.STEERING
    gentle = cascade_law(LINE_BACKWARDS, 1.0, CascadeTuning(max_curvature=0.1, bending_gain=0.1))
    assert gentle(Pose(0, 0.2, 0.0), 0.0, 0.0, -0.2).limit is Limit.CURVATURE
    bent = cascade_law(LINE_BACKWARDS, 1.0, CascadeTuning(max_bending_rad=0.1, bending_gain=0.1))
    assert bent(Pose(0, 0.2, 0.0), 0.0, 0.0, -0.2).limit is Limit.BENDING


def test_a_truck_alone_is_steered_in_both_directions() -> None:
    truck = ArticulatedVehicle(0.215, (), math.radians(32))
    for backward, direction in ((False, 0.0), (True, math.pi)):
        path = Path([Piece(0, 0, direction, math.inf, 0.0, backward)])
        step = CascadeFollower(truck, path, CascadeTuning()).step(Pose(0, 0.1, 0), 0.0, 0.0, 0.2)
        assert step.steering_rad < 0
        assert step.bending_target_rad is step.errors.bending_rad is None


def test_a_path_with_bends_is_followed_backwards_to_its_end() -> None:
    path = join_waypoints([(0, 0), (-3, 0), (-3, 4), (-6, 4)], 1.2, backward=True)
    rate = math.radians(60)
    plant = placed(path.pieces[0], Errors(), rate)
    law = CascadeFollower(SEMITRAILER, path, CascadeTuning(), rate)
    worst = 0.0
    while (step := law.step(plant.trailer, plant.bending_rad, plant.steering_rad, -0.2)).remaining_m > 0:
        worst = max(worst, abs(step.errors.position_m))
        plant.advance(-0.2, step.steering_rad, 0.05)
    assert worst < 0.06
    assert (plant.trailer.x_m, plant.trailer.y_m) == pytest.approx((-6, 4), abs=0.01)
