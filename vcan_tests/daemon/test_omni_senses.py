"""What a robot on omni-wheels knows of its own motion: readings of a robot that stands, grips, slips or pushes."""

from __future__ import annotations

import msgspec
import pytest

from daemon.loops.accelerometer import Mounting
from daemon.loops.measurement import Measurement
from daemon.loops.omni_senses import LONGEST_SLIP_S, OmniSenses, omni_kinematics, omni_observer
from profiles.loader import load
from profiles.schema import OmniGeometry, Profile

DT = 0.01
TURTLE = load("turtle").profile
assert isinstance(TURTLE.vehicle, OmniGeometry)
KINEMATICS = omni_kinematics(TURTLE.vehicle)


def senses() -> OmniSenses:
    return OmniSenses(KINEMATICS, Mounting(), omni_observer(TURTLE, KINEMATICS))


class Ride:
    """A robot whose wheels roll as they would straight ahead, whatever its body does."""

    def __init__(self) -> None:
        self.senses = senses()
        self._travel = [0.0, 0.0, 0.0]
        self._now = 0.0

    def roll(self, speed: float, acceleration: float, seconds: float, current_a: float = 0.0) -> None:
        """Speed of the wheels, acceleration of the body, current in the wheels' directions."""
        rims = KINEMATICS.wheel_speeds((speed, 0.0, 0.0))
        currents = tuple(current_a * share for share in KINEMATICS.wheel_speeds((1.0, 0.0, 0.0)))
        for _ in range(round(seconds / DT)):
            self._now += DT
            self._travel = [way + rim * DT for way, rim in zip(self._travel, rims, strict=True)]
            measurement = Measurement(
                self._now, rims, tuple(self._travel), acceleration_m_s2=(acceleration, 0.0), motor_current_a=currents
            )
            self.senses.update(measurement, DT, powered=True, standing=False)


def spinning() -> Ride:
    """The wheels run at 0.5 m/s, and the body has stayed behind."""
    ride = Ride()
    ride.roll(0.0, 0.0, 0.1)
    ride.roll(0.5, 0.0, 0.1)
    return ride


def test_wheels_that_run_while_the_body_stays_slip() -> None:
    ride = spinning()
    assert (ride.senses.slipping, ride.senses.pushing) == (True, False)


def test_slip_that_does_not_end_is_the_observers_error() -> None:
    ride = spinning()
    ride.roll(0.5, 0.0, LONGEST_SLIP_S)
    assert not ride.senses.slipping


def test_wheels_that_slip_under_a_force_that_moves_nothing_push() -> None:
    ride = Ride()
    ride.roll(0.0, 0.0, 0.1)
    ride.roll(0.5, 0.0, 0.2, current_a=6.0)
    assert ride.senses.pushing


def test_without_power_the_wheels_are_believed() -> None:
    ride = spinning()
    still = (0.0, 0.0, 0.0)
    ride.senses.update(Measurement(1.0, still, still, acceleration_m_s2=(9.0, 0.0)), DT, powered=False, standing=True)
    assert (ride.senses.slipping, ride.senses.observed) == (False, None)


@pytest.mark.parametrize(
    "profile",
    [
        msgspec.structs.replace(TURTLE, traction=None),
        msgspec.structs.replace(TURTLE, network=msgspec.structs.replace(TURTLE.network, synchronous=False)),
    ],
)
def test_there_is_no_observer_without_the_data_or_the_readings_for_it(profile: Profile) -> None:
    assert omni_observer(profile, KINEMATICS) is None
