"""The car's law, numbers only."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.loops.ackermann_drive import CarLaw, CarTarget
from daemon.loops.measurement import Measurement
from profiles.loader import load
from profiles.steered import CarGeometry

PROFILE = load("ackermann").profile
assert isinstance(PROFILE.vehicle, CarGeometry)
GEOMETRY = PROFILE.vehicle
DT = 0.01
WHEEL_M_S2 = 2.5


def law() -> CarLaw:
    return CarLaw(GEOMETRY, PROFILE.limits, 0.1, WHEEL_M_S2, 0.1, DT)


class IdealCar:
    """Does at once what it is told."""

    def __init__(self) -> None:
        self.speeds = (0.0, 0.0, 0.0)
        self.heading_rad = self.steering_rad = 0.0

    def measurement(self) -> Measurement:
        return Measurement(0.0, self.speeds, (0.0, 0.0, 0.0), (self.steering_rad,))

    def move(self, speeds: tuple[float, ...]) -> None:
        left, right, arm = speeds
        self.speeds = (left, right, arm)
        self.steering_rad += arm / 0.1 * DT
        self.heading_rad += (left + right) / 2 * math.tan(self.steering_rad) / GEOMETRY.wheelbase_m * DT


targets = st.builds(
    CarTarget,
    speed_m_s=st.floats(0, 2),
    heading_rad=st.none() | st.floats(-4, 4),
    steering_rad=st.floats(-0.8, 0.8),
).map(lambda t: t if t.heading_rad is None else CarTarget(t.speed_m_s, t.heading_rad))


@given(st.lists(targets, min_size=1, max_size=6))
def test_whatever_is_asked_wheels_keep_their_range_and_the_outer_one_its_ramp(wanted: list[CarTarget]) -> None:
    car, one = IdealCar(), law()
    for target in wanted:
        for _ in range(60):
            before = car.speeds
            command, record = one.step(car.measurement(), car.heading_rad, target, DT)
            left, right, _ = command.wheel_speed_m_s
            outer = 1 if car.steering_rad > 0 else 0
            assert 0.0 <= min(left, right) <= max(left, right) <= PROFILE.limits.wheel_speed_m_s * (1 + 1e-9)
            assert abs(command.wheel_speed_m_s[outer] - before[outer]) <= WHEEL_M_S2 * DT * (1 + 1e-9)
            assert record.speed_m_s <= PROFILE.limits.speed_m_s
            car.move(command.wheel_speed_m_s)


@given(st.floats(-0.75, 0.75), st.floats(0.2, 0.8), st.floats(0.3, 3.0))
def test_an_arc_is_as_long_as_asked_and_begins_when_steered(steering: float, speed: float, way: float) -> None:
    car, one, driven = IdealCar(), law(), 0.0
    target = CarTarget(speed, steering_rad=steering, distance_m=way)
    for _ in range(3000):
        command, record = one.step(car.measurement(), car.heading_rad, target, DT)
        if record.speed_m_s > 0:
            assert car.steering_rad == pytest.approx(steering, abs=math.radians(0.31))
        driven += record.speed_m_s * DT
        car.move(command.wheel_speed_m_s)
        if record.done:
            break
    assert driven == pytest.approx(way, abs=1e-4)
