"""The simulated semi-trailer against what is known of it: stable motion, momentum, rest, stops."""

from __future__ import annotations

import math

import msgspec
import pytest

from canhelm.errors import ConfigError
from daemon.loops.articulated import ArticulatedVehicle, Hitch
from daemon.loops.odometry import Pose
from drivers.simulated.semitrailer import SemitrailerWorld
from profiles.loader import load
from profiles.schema import Profile

PROFILE = load("semitrailer").profile
KINEMATICS = ArticulatedVehicle(0.215, (Hitch(-0.013, 0.615),), math.radians(32))


class SteadySpeed:
    """A power stage that holds a speed of the motor."""

    def __init__(self, rad_s: float) -> None:
        self._rad_s = rad_s
        self._sum = 0.0

    def current_demand(self, speed_rad_s: float, position_rad: float, dt_s: float) -> float:
        error = self._rad_s - speed_rad_s
        self._sum += error * dt_s
        return max(-4.0, min(4.0, 0.02 * error + 0.2 * self._sum))


def driving(speed_m_s: float, steering_deg: float, bending_deg: float = 0.0) -> SemitrailerWorld:
    """The vehicle with a fixed steering angle, its motor at a speed."""
    world = SemitrailerWorld(PROFILE)
    world.place((0.0, 0.0, 0.0), math.radians(bending_deg), math.radians(steering_deg))
    drive = PROFILE.drives["drive"]
    world.axes["drive"].torque_source = SteadySpeed(speed_m_s / drive.wheel_radius_m * drive.total_ratio)
    world.advance(0.0)
    return world


@pytest.mark.parametrize("steering_deg", [-12.0, -5.0, 3.0, 10.0])
def test_it_takes_the_bending_angle_of_stable_motion(steering_deg: float) -> None:
    world = driving(0.15, steering_deg)
    world.advance(25.0)
    stable = KINEMATICS.hitches[0].stable_bending(KINEMATICS.curvature(math.radians(steering_deg)))
    assert stable is not None
    assert math.degrees(world.bending_rad - stable) == pytest.approx(0.0, abs=0.7)
    forward, _, yaw_rate = world.velocity
    assert yaw_rate / forward == pytest.approx(KINEMATICS.curvature(math.radians(steering_deg)), rel=0.01)


def test_straight_on_it_goes_as_far_as_its_wheel_rolls() -> None:
    world = driving(0.3, 0.0)
    world.advance(10.0)
    x, y, yaw = world.pose
    rolled = world.axes["drive"].position_rad / PROFILE.drives["drive"].total_ratio * 0.04
    assert (x, y, yaw) == pytest.approx((rolled, 0.0, 0.0), abs=0.005)


def test_backwards_it_jackknifes_until_truck_and_trailer_touch() -> None:
    world = driving(-0.2, 0.0, bending_deg=2.0)
    world.advance(30.0)
    assert world.touching
    assert math.degrees(world.bending_rad) == pytest.approx(80.0)


def test_the_trailers_axle_is_where_the_geometry_puts_it() -> None:
    world = SemitrailerWorld(PROFILE)
    world.place((1.0, 2.0, 0.5), 0.3, 0.1)
    trailer = KINEMATICS.poses(Pose(*world.pose), (world.bending_rad,))[1]
    assert world.trailer_pose == pytest.approx((trailer.x_m, trailer.y_m, trailer.yaw_rad))
    assert world.heading_rad("steering_angle") == 0.1
    assert world.heading_rad("bending_angle") == 0.3


def test_without_a_force_it_stays_where_it_is() -> None:
    world = SemitrailerWorld(PROFILE)
    world.place((1.0, 2.0, 0.5), 0.3)
    world.advance(0.0)
    world.advance(100.0)
    assert world.pose == pytest.approx((1.0, 2.0, 0.5))
    assert not world.moving


def test_on_ice_both_bodies_keep_momentum_and_energy() -> None:
    """Without friction nothing but the hitch acts on them."""
    world = SemitrailerWorld(_on_ice())
    world.place((0.0, 0.0, 0.0), math.radians(40.0))
    world.advance(0.0)
    world._yaw_rate, world._quiet_steps = 0.4, 0
    before, after = _momentum_and_energy(world, 0.001), _momentum_and_energy(world, 2.0)
    assert after == pytest.approx(before, rel=0.01, abs=2e-3)


def _on_ice() -> Profile:
    assert PROFILE.simulation is not None
    tyre = msgspec.structs.replace(PROFILE.simulation.tyre, friction=1e-6, rolling_resistance=0.0)
    return msgspec.structs.replace(PROFILE, simulation=msgspec.structs.replace(PROFILE.simulation, tyre=tyre))


def _centres(world: SemitrailerWorld) -> tuple[float, ...]:
    """Centres of mass and headings of truck and trailer."""
    (x, y, yaw), (u, v, turned) = world.pose, world.trailer_pose
    ahead = 0.615 - 0.35
    truck = x + 0.1 * math.cos(yaw), y + 0.1 * math.sin(yaw), yaw
    return (*truck, u + ahead * math.cos(turned), v + ahead * math.sin(turned), turned)


def _momentum_and_energy(world: SemitrailerWorld, at_s: float) -> tuple[float, float, float]:
    """Of both bodies together, by the way that they go in two milliseconds."""
    world.advance(at_s)
    before = _centres(world)
    world.advance(at_s + 0.002)
    vx, vy, w, ux, uy, turning = ((b - a) / 0.002 for a, b in zip(before, _centres(world), strict=True))
    energy = 5 * (vx * vx + vy * vy) + 0.06 * w * w + 6 * (ux * ux + uy * uy) + 0.3 * turning * turning
    return 5 * vx + 6 * ux, 5 * vy + 6 * uy, energy / 2


def test_tyres_that_are_too_stiff_are_refused() -> None:
    assert PROFILE.simulation is not None
    tyre = msgspec.structs.replace(PROFILE.simulation.tyre, relaxation_length_m=0.0001)
    simulation = msgspec.structs.replace(PROFILE.simulation, tyre=tyre)
    with pytest.raises(ConfigError, match="too stiff"):
        SemitrailerWorld(msgspec.structs.replace(PROFILE, simulation=simulation))
