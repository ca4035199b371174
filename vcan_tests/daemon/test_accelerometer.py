"""The accelerometer's mounting: signs and terms proven by the motion of the sensor itself, differentiated."""

from __future__ import annotations

import cmath
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.loops.accelerometer import Accelerometer, CentreAcceleration, Mounting, rotated, turning_terms

DT = 0.01
STEP = 1e-4
lengths = st.floats(-0.5, 0.5)
angles = st.floats(-math.pi, math.pi)
rates = st.floats(-4.0, 4.0)


def heading(time: float, rate: float) -> float:
    return 0.3 + rate * time + 0.8 * math.sin(2 * time)


def centre(time: float) -> complex:
    return complex(0.7 * time * time + math.sin(1.3 * time), math.cos(0.9 * time) - 0.2 * time**3)


def felt(mounting: Mounting, rate: float, time: float) -> complex:
    """What the sensor reads: the second difference of its place in the room, seen along its own axes."""
    arm = complex(mounting.x_m, mounting.y_m)

    def place(at: float) -> complex:
        return centre(at) + arm * cmath.rect(1.0, heading(at, rate))

    acceleration = (place(time + STEP) - 2 * place(time) + place(time - STEP)) / STEP**2
    return acceleration * cmath.rect(1.0, -heading(time, rate) - mounting.rotation_rad)


@given(lengths, lengths, angles, rates, st.floats(0, 2))
def test_the_terms_give_the_centres_acceleration_of_a_body_that_drives_and_turns(
    x: float, y: float, rotation: float, rate: float, time: float
) -> None:
    mounting = Mounting(x, y, rotation)
    reading = felt(mounting, rate, time)
    point = rotated((reading.real, reading.imag), rotation)
    yaw_rate = rate + 1.6 * math.cos(2 * time)
    euler, centripetal = turning_terms(mounting, yaw_rate, -3.2 * math.sin(2 * time))
    own = (centre(time + STEP) - 2 * centre(time) + centre(time - STEP)) / STEP**2
    own *= cmath.rect(1.0, -heading(time, rate))
    assert point[0] - euler[0] - centripetal[0] == pytest.approx(own.real, abs=1e-4)
    assert point[1] - euler[1] - centripetal[1] == pytest.approx(own.imag, abs=1e-4)


def run(sensor: Accelerometer, mounting: Mounting, rate: float, seconds: float) -> list[CentreAcceleration]:
    steps = []
    for number in range(round(seconds / DT)):
        time = number * DT
        reading = felt(mounting, rate, time)
        yaw_rate = rate + 1.6 * math.cos(2 * time)
        steps.append(sensor.step((reading.real, reading.imag), yaw_rate, DT))
    return steps


def test_step_by_step_the_error_is_that_of_the_smoothed_yaw_rate() -> None:
    mounting = Mounting(0.05, 0.15, math.radians(70))
    steps = run(Accelerometer(mounting), mounting, 2.0, 3.0)
    for number, step in enumerate(steps[10:], start=10):
        own = (centre(number * DT + STEP) - 2 * centre(number * DT) + centre(number * DT - STEP)) / STEP**2
        own *= cmath.rect(1.0, -heading(number * DT, 2.0))
        assert math.dist(step.centre, (own.real, own.imag)) < 0.03


def test_turning_on_the_spot_is_no_acceleration_of_the_centre() -> None:
    sensor = Accelerometer(Mounting(0.0, 0.2))
    for _ in range(20):
        step = sensor.step((0.0, -(3.0**2) * 0.2), 3.0, DT)
    assert step.centripetal == pytest.approx((0.0, -1.8))
    assert step.centre == pytest.approx((0.0, 0.0), abs=1e-9)


def test_spinning_up_pushes_a_sensor_on_the_left_backward() -> None:
    euler, _ = turning_terms(Mounting(0.0, 0.2), 0.0, 5.0)
    assert euler == pytest.approx((-1.0, 0.0))


def test_a_sensor_turned_to_the_left_reads_forward_acceleration_on_its_right() -> None:
    step = Accelerometer(Mounting(rotation_rad=math.pi / 2)).step((0.0, -1.0), 0.0, DT)
    assert step.centre == pytest.approx((1.0, 0.0))


def test_what_it_reads_at_rest_is_its_offset() -> None:
    sensor = Accelerometer(Mounting())
    for _ in range(400):
        sensor.step((0.3, -0.2), 0.0, DT, at_rest=True)
    step = sensor.step((1.3, -0.2), 0.0, DT)
    assert step.offset == pytest.approx((0.3, -0.2), abs=1e-3)
    assert step.centre == pytest.approx((1.0, 0.0), abs=1e-3)


@pytest.mark.parametrize("reading", [(math.nan, 0.0), (0.0, math.inf), (1e9, 0.0)])
def test_a_reading_that_is_none_repeats_the_last_one(reading: tuple[float, float]) -> None:
    sensor = Accelerometer(Mounting())
    sensor.step((0.5, 0.1), 0.0, DT)
    step = sensor.step(reading, 0.0, DT)
    assert (step.valid, step.centre) == (False, (0.5, 0.1))


def test_a_yaw_rate_that_is_none_does_not_stay() -> None:
    sensor = Accelerometer(Mounting(0.1, 0.1))
    sensor.step((0.0, 0.0), math.nan, DT)
    assert sensor.step((0.2, 0.0), 0.0, DT).centre == pytest.approx((0.2, 0.0))
