"""Traction of the simulated MAX2D: tyres on ice, slip by residuals and currents against the truth."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import pytest

from daemon.loops.paired_traction import PairedTraction, PairedTractionRecord
from daemon.loops.slip_observer import RimDrive, rim_drive
from drivers.simulated.tyre import Contact
from profiles.schema import TractionConfig
from vcan_tests.drivers.max2d_bench import (
    PROFILE,
    Robot,
    contact_points,
    simulation,
    turning_speeds,
    vehicle,
    with_tyre,
)

DT = 0.01
ICE = 0.03
SLIPS_M_S = 0.1


@dataclass
class Run:
    """What became of a drive."""

    worst_slip_m_s: float = 0.0
    yaw_rad: float = 0.0
    aside_m: float = 0.0
    hits: int = 0
    missed: int = 0
    false: int = 0
    records: list[PairedTractionRecord] = field(default_factory=list)


class Bench:
    """The MAX2D with locked pairs; wheels named are on ice between 0.1 s and the end of it."""

    def __init__(self, headings: tuple[float, float], iced: tuple[int, ...], ice_s: float) -> None:
        self.robot = Robot(headings=headings)
        for brake in vehicle().brakes:
            self.robot.world.set_brake(brake, True)
        self.traction = PairedTraction(vehicle(), drives(), headings)
        self.points = contact_points(*headings)
        self.headings = (headings[0], headings[0], headings[1], headings[1])
        self.iced, self.ice_s = iced, ice_s

    def slips(self) -> list[float]:
        """Rim speed minus the contact point's along the heading, by the world's truth."""
        vx, vy, rate = self.robot.world.velocity
        wheels = zip(self.robot.world.wheels.values(), self.points, self.headings, strict=True)
        return [
            wheel.drive.rim_m_s - (vx - rate * y) * math.cos(heading) - (vy + rate * x) * math.sin(heading)
            for wheel, (x, y), heading in wheels
        ]

    def run(self, wheel_speeds: list[float], seconds: float, on: bool) -> Run:
        """Ramp to the speeds within a second, and hold them."""
        run, robot = Run(), self.robot
        for number in range(round(seconds / DT)):
            if number == round(0.1 / DT):
                self.put_on(ICE)
            if number == round(self.ice_s / DT):
                self.put_on(simulation().tyre.friction)
            wanted = [speed * min(1.0, number * DT) for speed in wheel_speeds]
            record = self.traction.step(wanted, *self.measure(), DT)
            robot.roll(*(record.grip.wheel_speeds_m_s if on else wanted), for_s=DT)
            self.judge(run, record)
        run.yaw_rad, run.aside_m = abs(robot.world.pose[2]), abs(robot.world.pose[1])
        return run

    def put_on(self, friction: float) -> None:
        tyre = with_tyre(friction=friction).simulation
        assert tyre is not None
        for wheel in self.iced:
            list(self.robot.world.wheels.values())[wheel].contact = Contact(tyre.tyre)

    def measure(self) -> tuple[list[float], list[float]]:
        wheels = self.robot.world.wheels.values()
        directions = [PROFILE.drives[name].direction for name in vehicle().wheels]
        currents = [sign * wheel.drive.axis.current_a for sign, wheel in zip(directions, wheels, strict=True)]
        return [wheel.drive.rim_m_s for wheel in wheels], currents

    def judge(self, run: Run, record: PairedTractionRecord) -> None:
        run.records.append(record)
        for slip, slipping in zip(self.slips(), record.slipping, strict=True):
            run.worst_slip_m_s = max(run.worst_slip_m_s, abs(slip))
            run.hits += abs(slip) > SLIPS_M_S and slipping
            run.missed += abs(slip) > SLIPS_M_S and not slipping
            run.false += abs(slip) < SLIPS_M_S / 5 and slipping


def drives() -> list[RimDrive]:
    load_n = vehicle().mass_kg * 9.81 / 4
    rolling_n = simulation().tyre.rolling_resistance * load_n
    traction = TractionConfig(
        response_s=0.02, wheel_inertia_kg_m2=simulation().wheel_inertia_kg_m2, rolling_resistance_n=rolling_n
    )
    return [rim_drive(PROFILE.drives[name], traction) for name in vehicle().wheels]


STRAIGHT = [0.8] * 4
THREE = (0, 1, 2)
ALL = (0, 1, 2, 3)


def test_on_dry_floor_nothing_is_held() -> None:
    run = Bench((0.0, 0.0), (), 9.0).run(STRAIGHT, 2.0, on=True)
    assert not any(any(record.slipping) for record in run.records)


@pytest.mark.parametrize(("rear", "front"), [(0.15, -0.3), (-0.35, 0.35)])
def test_a_curve_is_no_slip(rear: float, front: float) -> None:
    _, speeds = turning_speeds(rear, front, 0.5)
    run = Bench((rear, front), (), 9.0).run(speeds, 2.0, on=True)
    assert not any(any(record.slipping) for record in run.records)


@pytest.mark.parametrize("iced", [THREE, ALL])
def test_wheels_on_ice_are_told(iced: tuple[int, ...]) -> None:
    run = Bench((0.0, 0.0), iced, 0.8).run(STRAIGHT, 1.5, on=False)
    assert run.hits > 100
    assert run.missed < 0.05 * run.hits


def test_one_wheel_that_spins_is_told_by_its_residual_at_once() -> None:
    """In a sharp curve, where currents do not count."""
    headings = (-0.35, 0.35)
    _, speeds = turning_speeds(*headings, 0.5)
    spinning = [speeds[0], speeds[1], speeds[2] + 0.2, speeds[3]]
    record = PairedTraction(vehicle(), drives(), headings).step(speeds, spinning, [0.0] * 4, DT)
    assert (record.by_currents, record.slipping[2]) == (False, True)
    assert record.grip.wheel_speeds_m_s[2] <= speeds[2]


def test_where_the_other_wheels_carry_the_robot_nothing_is_held() -> None:
    run = Bench((0.0, 0.0), (0, 3), 0.8).run(STRAIGHT, 1.5, on=True)
    assert run.worst_slip_m_s < SLIPS_M_S
    assert run.false == 0


@pytest.mark.parametrize(("iced", "part"), [(THREE, 0.7), (ALL, 0.25)])
def test_wheels_on_ice_are_kept_from_spinning(iced: tuple[int, ...], part: float) -> None:
    free = Bench((0.0, 0.0), iced, 0.8).run(STRAIGHT, 1.5, on=False)
    held = Bench((0.0, 0.0), iced, 0.8).run(STRAIGHT, 1.5, on=True)
    assert held.worst_slip_m_s < part * free.worst_slip_m_s
    assert held.yaw_rad <= free.yaw_rad


def test_where_all_wheels_slip_alike_there_is_no_residual_but_the_currents_tell() -> None:
    run = Bench((0.0, 0.0), ALL, 0.8).run(STRAIGHT, 0.7, on=False)
    last = run.records[-1]
    assert max(map(abs, last.residual_m_s)) < 0.01
    assert all(last.observed.slipping)


def test_a_reading_that_is_none_holds_nothing() -> None:
    traction = PairedTraction(vehicle(), drives(), (0.0, 0.0))
    record = traction.step(STRAIGHT, [math.nan] * 4, [0.0] * 4, DT)
    assert record.grip.wheel_speeds_m_s == tuple(STRAIGHT)
