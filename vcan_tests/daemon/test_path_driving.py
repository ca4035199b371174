"""Driving whole paths with the ideal semi-trailer: sections, cusps, ends, speed limits, guards."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Iterator
from itertools import pairwise

import pytest

from daemon.campaigns.ideal_semitrailer import LINE_BACKWARDS, SEMITRAILER, Errors, SemitrailerPlant, placed
from daemon.loops.articulated import ArticulatedVehicle
from daemon.loops.odometry import Pose
from daemon.loops.path import Path, Piece, wrap
from daemon.loops.path_driving import DrivingStep, PathDriver, Phase, VehicleReading, at_begin
from daemon.loops.path_speed import SpeedLimit, SpeedTuning
from daemon.runtime.path_building import build_path
from profiles.path_file import load_path_file

DT = 0.01
RATE = math.radians(60)
SPEED = SpeedTuning(0.4, 0.3, 0.3, backward_m_s=0.2)


def shipped(name: str, exchanged: bool = False) -> Path:
    """A shipped path that begins at the origin."""
    spec = load_path_file(name).spec
    backward = exchanged != (spec.pieces[0].drive == "backward")
    begin = Pose(-SEMITRAILER.straight_lead_m if backward else 0.0)
    building = build_path(
        spec,
        begin,
        lead_m=SEMITRAILER.straight_lead_m,
        exchanged=exchanged,
        forward_curvature=2.6,
        backward_curvature=1.7,
        run_out_m=0.4,
    )
    return asyncio.run(building)


def reading(plant: SemitrailerPlant, speed_m_s: float) -> VehicleReading:
    return VehicleReading(plant.truck, (plant.bending_rad,), plant.steering_rad, speed_m_s)


def driven(driver: PathDriver, plant: SemitrailerPlant, seconds: float = 200.0) -> Iterator[DrivingStep]:
    """Steps until the drive is done."""
    speed = 0.0
    for _ in range(round(seconds / DT)):
        step = driver.step(reading(plant, speed), DT)
        yield step
        if step.phase is Phase.DONE:
            return
        speed = step.speed_m_s
        plant.advance(speed, step.steering_rad, DT)
    raise AssertionError("the drive never ended")


def fresh() -> SemitrailerPlant:
    return SemitrailerPlant((0.0, 0.0, 0.0, 0.0), 0.0, RATE)


WAYS = [(name, False) for name in ("line", "circle", "reverse", "park-parallel", "park-perpendicular")]


@pytest.mark.parametrize(("name", "exchanged"), [*WAYS, ("line", True), ("circle", True)])
@pytest.mark.parametrize("published", [False, True])
def test_it_ends_where_the_path_ends(name: str, exchanged: bool, published: bool) -> None:
    path, plant = shipped(name, exchanged), fresh()
    steps = list(driven(PathDriver(SEMITRAILER, path, SPEED, RATE, published), plant))
    last = path.pieces[-1]
    unit = plant.trailer if last.backward else plant.truck
    assert math.dist(last.point(last.length_m), (unit.x_m, unit.y_m)) < 0.002
    assert math.degrees(abs(wrap(unit.yaw_rad - last.heading(last.length_m)))) < 0.5
    assert not steps[-1].failure


def test_a_cusp_is_driven_in_both_directions_with_a_rest_between() -> None:
    steps = list(driven(PathDriver(SEMITRAILER, shipped("reverse"), SPEED, RATE), fresh()))
    signs = [math.copysign(1.0, step.speed_m_s) for step in steps if step.speed_m_s]
    changes = [(a, b) for a, b in pairwise(signs) if a != b]
    assert changes == [(1.0, -1.0), (-1.0, 1.0)]
    assert {step.section for step in steps} == {0, 1, 2}


def test_the_steering_is_set_before_a_section_begins() -> None:
    steps = driven(PathDriver(SEMITRAILER, shipped("circle"), SPEED, RATE), fresh())
    at_rest = [step for step in steps if step.phase is Phase.STEERING]
    assert len(at_rest) * DT == pytest.approx(math.atan(0.215) / RATE, abs=0.05)
    assert all(step.speed_m_s == 0.0 for step in at_rest)


def test_the_steering_of_an_eight_driven_backwards_looks_ahead() -> None:
    steps = driven(PathDriver(SEMITRAILER, shipped("eight", exchanged=True), SPEED, RATE), fresh())
    assert max(abs(step.following.errors.position_m) for step in steps) < 0.03


def first_driving_step(errors: Errors, speed: SpeedTuning = SPEED, piece: Piece = LINE_BACKWARDS) -> DrivingStep:
    steps = driven(PathDriver(SEMITRAILER, Path([piece]), speed, RATE), placed(piece, errors, RATE))
    return next(step for step in steps if step.phase is Phase.DRIVING)


@pytest.mark.parametrize("errors", [Errors(), Errors(position_m=0.24), Errors(heading_rad=math.radians(-19))])
def test_errors_that_the_law_takes_back_do_not_lower_the_speed(errors: Errors) -> None:
    assert first_driving_step(errors).speed_limit is SpeedLimit.STEERING


@pytest.mark.parametrize("errors", [Errors(position_m=0.4), Errors(heading_rad=math.radians(30))])
def test_far_from_the_path_it_drives_slower(errors: Errors) -> None:
    assert first_driving_step(errors).speed_limit is SpeedLimit.ERROR


def test_before_and_in_a_bend_it_drives_slower() -> None:
    truck = ArticulatedVehicle(0.215, (), math.radians(32))
    path = Path([Piece(0, 0, 0, 2.0), Piece(2, 0, 0, 2.0, 0.5)])
    driver = PathDriver(truck, path, SpeedTuning(1.0, 0.5, 0.045), RATE)
    for x_m, wanted in ((0.5, SpeedLimit.COMMAND), (1.9, SpeedLimit.CURVATURE), (2.5, SpeedLimit.CURVATURE)):
        assert driver.step(VehicleReading(Pose(x_m), (), 0.0, 0.3), DT).speed_limit is wanted


def test_bending_too_far_ends_the_drive_by_name() -> None:
    bent = ArticulatedVehicle(0.215, SEMITRAILER.hitches, math.radians(32), math.radians(30))
    plant = placed(LINE_BACKWARDS, Errors(heading_rad=math.radians(-25), bending_rad=math.radians(20)), RATE)
    *_, last = driven(PathDriver(bent, Path([LINE_BACKWARDS]), SPEED, RATE), plant)
    assert "jackknife guard" in last.failure
    assert abs(plant.bending_rad) < math.radians(30)


def test_straying_from_the_path_ends_the_drive_by_name() -> None:
    *_, last = driven(
        PathDriver(SEMITRAILER, Path([LINE_BACKWARDS]), SPEED, RATE), placed(LINE_BACKWARDS, Errors(position_m=0.7))
    )
    assert "strayed" in last.failure


def test_a_stop_brings_it_to_rest_on_the_way() -> None:
    driver, plant = PathDriver(SEMITRAILER, Path([LINE_BACKWARDS]), SPEED, RATE), placed(LINE_BACKWARDS, Errors())
    steps = driven(driver, plant)
    for _ in range(200):
        next(steps)
    driver.stop()
    *_, last = steps
    assert (last.speed_m_s, last.failure) == (0.0, "")


def test_a_vehicle_that_is_elsewhere_may_not_begin() -> None:
    path = Path([Piece(1.0, 0.0, 0.0, 1.0)])
    assert at_begin(SEMITRAILER, path, Pose(0.5), (0.0,)) == ""
    assert "1.00 m away" in at_begin(SEMITRAILER, path, Pose(), (0.0,))
    assert "180 degrees" in at_begin(SEMITRAILER, path, Pose(1.0, 0.0, math.pi), (0.0,))


def test_the_published_laws_look_ahead_grows_with_the_speed_and_is_cut_at_the_end() -> None:
    path, plant, ahead = Path([Piece(0.0, 0.0, 0.0, 4.0)]), fresh(), {}
    for step in driven(PathDriver(SEMITRAILER, path, SPEED, RATE, published=True), plant):
        target, along = step.following.target, step.following.meeting.along_m
        assert target is not None
        ahead[round(along, 1)] = target[0] - along
    assert ahead[2.0] == pytest.approx(2 * 0.425, abs=0.01)
    assert ahead[3.9] == pytest.approx(0.425 / 2, abs=0.02)
