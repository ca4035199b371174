"""Slip of single wheels by motor currents, and its correction while pushing, on a robot whose wheels spin."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from daemon.loops.accelerometer import Accelerometer, Mounting
from daemon.loops.omni_senses import BY_ACCELEROMETER
from daemon.loops.slip_observer import Observed, ObserverTuning, SlipObserver
from daemon.loops.wheel_grip import WheelGrip, WheelGripTuning
from vcan_tests.daemon.gripping_robot import BODY, DRIVE, KINEMATICS, PLACE, ROTATION
from vcan_tests.daemon.omni_floor import CYCLE_S, OmniFloor, Place, dry, ice_between

WALL_X_M = 0.05
PRECISE = replace(BY_ACCELEROMETER, missed_m_s2=0.0)


class Bench:
    """Rim speeds commanded by a ramp, and what the observer makes of it."""

    def __init__(self, friction: Place, wall_x_m: float = 99.0) -> None:
        self.floor = OmniFloor(friction, wall_x_m=wall_x_m)
        self.observer = SlipObserver(BODY, [DRIVE] * 3, KINEMATICS.forward)
        self.grip: WheelGrip | None = None
        self.sensor: Accelerometer | None = None
        self.pushes: list[float] = []
        self.seen = self.observe()

    def observe(self) -> Observed:
        measured = None
        if self.sensor is not None:
            measured = self.sensor.step(self.floor.reading, self.seen.motion[2], CYCLE_S).centre
        return self.observer.step(self.floor.rims, self.floor.currents, CYCLE_S, measured)

    def speed_up(self, acceleration: float, top: float, seconds: float) -> None:
        for number in range(round(seconds / CYCLE_S)):
            speed = min(top, acceleration * number * CYCLE_S)
            wanted = KINEMATICS.wheel_speeds((speed, 0.0, 0.0))
            if self.grip is not None:
                wanted = self.grip.step(wanted, self.seen.ground_m_s, self.seen.slipping, CYCLE_S).wheel_speeds_m_s
            self.floor.roll(wanted)
            self.seen = self.observe()
            self.pushes.append(self.floor.forces[1] + (-self.floor.forces[0] - self.floor.forces[2]) / 2)


def test_on_dry_floor_no_wheel_slips() -> None:
    bench = Bench(dry)
    bench.speed_up(1.5, 1.2, 1.5)
    assert bench.seen.slipping == (False, False, False)
    assert bench.seen.motion[0] == pytest.approx(bench.floor.velocity.real, abs=0.03)


def test_currents_tell_the_forces_of_the_floor() -> None:
    bench = Bench(ice_between(-9, 9))
    bench.speed_up(1.5, 1.2, 0.6)
    assert bench.seen.wheel_forces_n == pytest.approx(bench.floor.forces, abs=1.0)


def test_on_ice_everywhere_the_body_is_told_from_its_wheels() -> None:
    """Three wheels that all spin leave no residual; their currents still tell."""
    bench = Bench(ice_between(-9, 9))
    bench.speed_up(1.5, 1.2, 0.8)
    assert any(bench.seen.slipping)
    assert bench.seen.motion[0] == pytest.approx(bench.floor.velocity.real, abs=0.1)
    assert bench.seen.slip_m_s == pytest.approx(bench.floor.slips, abs=0.15)


def test_the_wheel_that_is_on_ice_is_named() -> None:
    left = ice_between(-9, 9, 0.05)
    bench = Bench(left)
    bench.speed_up(1.5, 1.2, 0.45)
    slips = [abs(slip) for slip in bench.floor.slips]
    assert bench.seen.slipping[slips.index(max(slips))]


def test_the_observed_motion_starts_with_what_the_wheels_say() -> None:
    floor = OmniFloor()
    floor.start(1.2 + 0.3j)
    seen = SlipObserver(BODY, [DRIVE] * 3, KINEMATICS.forward).step(floor.rims, floor.currents, CYCLE_S)
    assert seen.motion[:2] == pytest.approx((1.2, 0.3), abs=0.05)
    assert seen.slipping == (False, False, False)


def test_a_reading_that_is_none_changes_nothing() -> None:
    bench = Bench(dry)
    bench.speed_up(1.0, 0.5, 0.3)
    assert bench.observer.step((math.nan, 0.0, 0.0), (0.0, 0.0, 0.0), CYCLE_S) is bench.seen


def test_a_measured_acceleration_takes_the_place_of_the_forces() -> None:
    observer = SlipObserver(BODY, [DRIVE] * 3, KINEMATICS.forward)
    seen = observer.step((0.0, 0.0, 0.0), (5.0, 5.0, 5.0), CYCLE_S, measured=(0.4, -0.2))
    assert seen.acceleration[:2] == (0.4, -0.2)


@pytest.mark.parametrize(("tuning", "slips"), [(BY_ACCELEROMETER, False), (PRECISE, True)])
def test_samples_that_miss_a_part_of_the_acceleration_are_no_slip_where_that_is_allowed_for(
    tuning: ObserverTuning, slips: bool
) -> None:
    """Drives that ramp to each target in a part of the cycle: samples tell 1.02 for 1.2 m/s2."""
    observer, slipped = SlipObserver(BODY, [DRIVE] * 3, KINEMATICS.forward, tuning=tuning), False
    for cycle in range(100):
        rims = KINEMATICS.wheel_speeds((1.2 - 1.2 * cycle * CYCLE_S, 0.0, 0.0))
        slipped |= any(observer.step(rims, (0.0, 0.0, 0.0), CYCLE_S, measured=(-1.02, 0.0)).slipping)
    assert slipped is slips


def test_pushing_a_wall_pulls_harder_with_the_wheels_held_near_their_best() -> None:
    spinning, held = Bench(dry, WALL_X_M), Bench(dry, WALL_X_M)
    held.grip = WheelGrip(3)
    held.sensor = Accelerometer(Mounting(PLACE.real, PLACE.imag, ROTATION))
    for bench in (spinning, held):
        bench.speed_up(1.0, 1.0, 0.8)
    assert max(map(abs, held.floor.slips)) < 0.15 < 0.5 < max(map(abs, spinning.floor.slips))
    assert sum(held.pushes[-20:]) > 1.1 * sum(spinning.pushes[-20:])


def test_only_wheels_that_slip_are_held() -> None:
    record = WheelGrip(3).step((1.0, 1.0, -1.0), (0.2, 0.9, -0.2), (True, False, True), CYCLE_S)
    assert record.limited == (True, False, True)
    assert record.wheel_speeds_m_s == pytest.approx((0.252, 1.0, -0.252))


def test_a_wheel_that_grips_again_is_let_go_by_and_by() -> None:
    tuning = WheelGripTuning()
    grip = WheelGrip(1, tuning)
    grip.step((1.0,), (0.0,), (True,), CYCLE_S)
    records = [grip.step((1.0,), (0.0,), (False,), CYCLE_S) for _ in range(200)]
    assert records[0].wheel_speeds_m_s[0] == pytest.approx(tuning.slip_m_s + tuning.recovery_m_s2 * CYCLE_S)
    assert (records[-1].allowance_m_s, records[-1].limited) == ((math.inf,), (False,))


def test_a_wheel_that_locks_is_kept_rolling() -> None:
    grip = WheelGrip(1)
    grip.step((1.0,), (1.0,), (False,), CYCLE_S)
    assert grip.step((0.5,), (0.9,), (True,), CYCLE_S).wheel_speeds_m_s == pytest.approx((0.806,))


def test_a_wrong_belief_in_fast_floor_makes_no_wheel_faster() -> None:
    grip = WheelGrip(1)
    speeds = [grip.step((0.3,), (5.0,), (True,), CYCLE_S).wheel_speeds_m_s[0] for _ in range(10)]
    assert max(speeds) == 0.3


def test_without_knowledge_of_the_floor_a_wheel_is_left_alone() -> None:
    assert WheelGrip(1).step((1.0,), (math.nan,), (True,), CYCLE_S).wheel_speeds_m_s == (1.0,)


def test_at_rest_dry_friction_holds_against_the_motor() -> None:
    assert DRIVE.floor_force(0.2, 0.0, 0.0) == 0.0
    assert DRIVE.floor_force(-0.2, 0.0, 0.0) == 0.0
