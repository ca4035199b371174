"""The law of a truck that a person drives: what it does to a truck of pure kinematics, whatever the person does."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daemon.loops.articulated import ArticulatedVehicle, Hitch
from daemon.loops.odometry import Pose
from daemon.loops.path_driving import VehicleReading
from daemon.loops.truck_drive import CREEP_M_S, JACKKNIFE, TruckLaw, TruckTarget
from profiles.loader import load
from profiles.steered import SemitrailerGeometry

PROFILE = load("semitrailer").profile
assert isinstance(PROFILE.vehicle, SemitrailerGeometry)
GEOMETRY, LIMITS = PROFILE.vehicle, PROFILE.limits
AXLE, TRAILER = GEOMETRY.steering, GEOMETRY.trailer
VEHICLE = ArticulatedVehicle(
    GEOMETRY.wheelbase_m,
    (Hitch(GEOMETRY.hitch_offset_m, TRAILER.length_m),),
    math.radians(AXLE.limit_deg),
    math.radians(TRAILER.max_bending_deg),
)
DT_S = 0.01
LIMIT_RAD = VEHICLE.bending_limits_rad[0]


class Truck:
    """A truck whose drives do at once what the law says."""

    def __init__(self, bending_rad: float = 0.0) -> None:
        self.law = TruckLaw(VEHICLE, AXLE, LIMITS)
        self.steering_rad = 0.0
        self.bending_rad = bending_rad
        self.speed_m_s = 0.0
        self.limits: set[str] = set()

    def drive(self, seconds: float, speed_m_s: float, steering_rad: float) -> None:
        """Hold the sticks there for a time."""
        for _ in range(round(seconds / DT_S)):
            reading = VehicleReading(Pose(), (self.bending_rad,), self.steering_rad, self.speed_m_s)
            record = self.law.step(reading, TruckTarget(speed_m_s, steering_rad), DT_S)
            self.limits |= set(record.limits_active)
            assert abs(record.speed_m_s - self.speed_m_s) <= LIMITS.acceleration_m_s2 * DT_S + 1e-12
            self.speed_m_s = record.speed_m_s
            motion = VEHICLE.motion(self.steering_rad, (self.bending_rad,), self.speed_m_s)
            self.bending_rad += motion.bending_rate_rad_s[0] * DT_S
            self.steering_rad += record.steering_rate_rad_s * DT_S


HANDS = st.lists(
    st.tuples(
        st.floats(0.05, 2.0),
        st.floats(-LIMITS.speed_m_s, LIMITS.speed_m_s),
        st.floats(-VEHICLE.max_steering_rad, VEHICLE.max_steering_rad),
    ),
    min_size=1,
    max_size=8,
)


@settings(max_examples=40)
@given(HANDS)
def test_whatever_the_sticks_do_backwards_full_steering_can_still_straighten_it(
    hands: list[tuple[float, float, float]],
) -> None:
    truck = Truck()
    for seconds, speed, steering in hands:
        truck.drive(seconds, -abs(speed), steering)
    assert abs(truck.bending_rad) < LIMIT_RAD


@settings(max_examples=40)
@given(HANDS)
def test_whatever_the_sticks_do_truck_and_trailer_never_touch(hands: list[tuple[float, float, float]]) -> None:
    truck = Truck()
    for seconds, speed, steering in hands:
        truck.drive(seconds, speed, steering)
    assert abs(truck.bending_rad) < VEHICLE.max_bending_rad


def test_at_the_limit_it_stands_and_says_why() -> None:
    truck = Truck()
    truck.drive(20.0, -LIMITS.speed_m_s, VEHICLE.max_steering_rad)
    assert truck.speed_m_s == pytest.approx(0.0, abs=1e-3)
    assert JACKKNIFE in truck.limits


def test_from_the_limit_it_is_straightened_forwards_and_crawls_backwards_with_full_steering() -> None:
    bent = LIMIT_RAD - math.radians(3.0)
    forwards, backwards = Truck(bent), Truck(bent)
    forwards.drive(5.0, LIMITS.speed_m_s, 0.0)
    backwards.drive(2.0, 0.0, -VEHICLE.max_steering_rad)
    backwards.drive(2.0, -LIMITS.speed_m_s, -VEHICLE.max_steering_rad)
    assert abs(forwards.bending_rad) < bent / 3
    assert abs(backwards.bending_rad) < bent
    assert backwards.speed_m_s <= -CREEP_M_S + 1e-9


def test_straight_on_it_drives_as_fast_as_it_may() -> None:
    truck = Truck()
    truck.drive(5.0, LIMITS.speed_m_s, 0.0)
    assert truck.speed_m_s == pytest.approx(LIMITS.speed_m_s)
    assert not truck.limits
