"""The thesis' path following: its formulas, its behaviour as printed and put right, pieces, sections."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.campaigns.following_runs import drive, thesis_law
from daemon.campaigns.ideal_semitrailer import (
    CIRCLE_BACKWARDS,
    LINE_BACKWARDS,
    SEMITRAILER,
    Errors,
    SemitrailerPlant,
    forwards,
    placed,
)
from daemon.loops.articulated import ArticulatedVehicle, Hitch
from daemon.loops.odometry import Pose
from daemon.loops.path import Path, Piece, join_waypoints, line
from daemon.loops.path_following import (
    FollowingStep,
    FollowingTuning,
    Limit,
    PathFollower,
    bending_law,
    circle_curvature,
    published_circle_curvature,
    published_target,
)

TUNING = FollowingTuning()
coordinate = st.floats(-3, 3)


@given(coordinate, coordinate, st.floats(-3, 3), st.floats(0.01, 3), st.floats(-3, 3))
def test_the_circle_goes_through_the_target(
    x: float, y: float, heading: float, distance: float, bearing: float
) -> None:
    pose = Pose(x, y, heading)
    target = (x + distance * math.cos(bearing), y + distance * math.sin(bearing))
    curvature = circle_curvature(pose, target)
    circle = Piece(x, y, heading, 1.0, curvature)
    _, offset = circle.project(*target)
    assert offset == pytest.approx(0, abs=1e-6)


def test_a_target_where_the_vehicle_is_asks_for_nothing() -> None:
    assert circle_curvature(Pose(1, 2, 3), (1, 2)) == 0.0


@given(st.floats(-1.2, 1.2), st.floats(-1.2, 1.2))
def test_backwards_the_bending_angle_goes_to_its_target(bending: float, target: float) -> None:
    steering = bending_law(SEMITRAILER, 4.0, target, bending)
    if abs(steering) < SEMITRAILER.max_steering_rad:
        (rate,) = SEMITRAILER.motion(steering, [bending], -0.2).bending_rate_rad_s
        assert rate * (target - bending) >= 0


def test_the_printed_curvature_drives_away_from_the_line() -> None:
    """Equation 3.6 as printed steers to the wrong side: from 0.1 m it is metres away after 4 m."""
    plant = placed(LINE_BACKWARDS, Errors(position_m=0.1))
    law = thesis_law(LINE_BACKWARDS, published=True)
    assert drive(law, plant, LINE_BACKWARDS, 20.0).worst[0] > 2


def test_the_printed_target_of_a_circle_is_off_the_circle() -> None:
    circle = Piece(1.0, 0.0, math.pi / 2, math.inf, 1.0)
    assert published_target(circle, 0.0, 0.425) == pytest.approx(circle.point(0.425)), "on the x axis it is right"
    assert published_target(circle, 1.0, 0.425) == pytest.approx((math.cos(1.425), math.sin(0.425 - 1.0)))


def test_the_printed_target_of_a_line_is_right() -> None:
    assert published_target(LINE_BACKWARDS, 1.0, 0.425) == LINE_BACKWARDS.point(1.425)


def test_put_right_the_law_returns_to_the_line() -> None:
    """The straight-line bound for 0.2 m of section 6.2.1: 0.2 m, 19 and 38 degrees."""
    plant = placed(LINE_BACKWARDS, Errors(position_m=0.2))
    run = drive(thesis_law(LINE_BACKWARDS), plant, LINE_BACKWARDS, 20.0)
    position, heading, bending = run.worst
    assert position == pytest.approx(0.2, abs=0.001)
    assert math.degrees(heading) == pytest.approx(19, abs=0.5)
    assert math.degrees(bending) == pytest.approx(38, abs=0.5)
    assert run.settle_m == pytest.approx(1.31, abs=0.02)


@pytest.mark.parametrize(
    "piece", [LINE_BACKWARDS, CIRCLE_BACKWARDS, forwards(LINE_BACKWARDS), forwards(CIRCLE_BACKWARDS)]
)
def test_without_error_the_vehicle_stays_on_the_path(piece: Piece) -> None:
    run = drive(thesis_law(piece), placed(piece, Errors()), piece, 20.0)
    assert run.worst[0] < 1e-6


def test_left_and_right_are_alike() -> None:
    runs = []
    for sign in (1, -1):
        errors = Errors(0.1 * sign, 0.05 * sign, -0.1 * sign)
        law = thesis_law(LINE_BACKWARDS)
        runs.append(drive(law, placed(LINE_BACKWARDS, errors), LINE_BACKWARDS, 10.0))
    assert runs[0].position_m == pytest.approx([-value for value in runs[1].position_m], abs=1e-9)


def test_the_limit_of_steering_is_told() -> None:
    law = PathFollower(SEMITRAILER, Path([LINE_BACKWARDS]), TUNING)
    assert law.step(Pose(0, 0.3, 0), 0.0).limit is Limit.STEERING
    assert law.step(Pose(0, 0.001, 0), 0.0).limit is None


def drive_section(law: PathFollower, plant: SemitrailerPlant) -> list[FollowingStep]:
    """Drive until the section's end is reached."""
    steps: list[FollowingStep] = []
    while True:
        backward = steps[-1].backward if steps else None
        step = law.step(plant.trailer if backward else plant.truck, plant.bending_rad)
        if backward is None and step.backward:
            step = law.step(plant.trailer, plant.bending_rad)
        steps.append(step)
        if step.remaining_m <= 0:
            return steps
        plant.advance(-0.2 if step.backward else 0.2, step.steering_rad, 0.05)


def test_a_path_with_bends_is_followed_backwards_to_its_end() -> None:
    path = join_waypoints([(0, 0), (-3, 0), (-3, 4), (-6, 4)], 1.2, backward=True)
    plant = placed(path.pieces[0], Errors())
    steps = drive_section(PathFollower(SEMITRAILER, path, TUNING), plant)
    assert [step.meeting.piece for step in steps] == sorted(step.meeting.piece for step in steps)
    assert max(abs(step.errors.position_m) for step in steps) < 0.06
    assert (plant.trailer.x_m, plant.trailer.y_m) == pytest.approx((-6, 4), abs=0.02)


def test_a_path_with_a_cusp_is_followed_section_by_section() -> None:
    path = join_waypoints([(0, 0), (2, 0), (-1, 0), (-1, -3)], 1.0, lead_m=SEMITRAILER.straight_lead_m)
    plant = placed(path.pieces[0], Errors())
    law = PathFollower(SEMITRAILER, path, TUNING)
    drive_section(law, plant)
    assert plant.truck.x_m == pytest.approx(2, abs=0.02)
    assert law.next_section()
    steps = drive_section(law, plant)
    assert all(step.backward for step in steps)
    assert (plant.trailer.x_m, plant.trailer.y_m) == pytest.approx((-1, -3), abs=0.02)
    assert not law.next_section()


def test_a_truck_alone_follows_in_both_directions() -> None:
    truck = ArticulatedVehicle(0.215, (), math.radians(32))
    for backward, direction in ((False, 0.0), (True, math.pi)):
        path = Path([Piece(0, 0, direction, math.inf, 0.0, backward)])
        step = PathFollower(truck, path, TUNING).step(Pose(0, 0.1, 0), 0.0)
        assert step.bending_target_rad is step.errors.bending_rad is None
        assert step.steering_rad < 0, "to the right forwards, and backwards the tail to the right"
        assert step.errors.position_m == pytest.approx(0.1)


@pytest.mark.parametrize("hitches", [(Hitch(0, 0.6), Hitch(0, 0.6)), (Hitch(0.7, 0.6),)])
def test_trailers_that_cannot_be_reversed_are_refused(hitches: tuple[Hitch, ...]) -> None:
    with pytest.raises(ValueError, match="only one trailer"):
        PathFollower(ArticulatedVehicle(0.2, hitches, 0.5), Path([line((0, 0), (9, 0))]), TUNING)


def test_the_printed_curvature_is_that_of_the_mirrored_circle() -> None:
    assert published_circle_curvature(Pose(0, 0, 0), (1, 1)) == -circle_curvature(Pose(0, 0, 0), (1, 1)) == -1.0


@pytest.mark.parametrize(("x", "bending"), [(math.nan, 0.0), (math.inf, 0.0), (0.0, math.nan)])
def test_a_lost_pose_or_bending_angle_is_not_steered_by(x: float, bending: float) -> None:
    law = PathFollower(SEMITRAILER, Path([LINE_BACKWARDS]), TUNING)
    with pytest.raises(ValueError, match="no steering"):
        law.step(Pose(x, 0.0, 0.0), bending)
