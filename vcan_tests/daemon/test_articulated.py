"""Truck and trailers: motion against differences of poses, stable motion, limits."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.campaigns.ideal_semitrailer import SEMITRAILER
from daemon.loops.articulated import ArticulatedVehicle, Hitch
from daemon.loops.odometry import Pose

HITCH = SEMITRAILER.hitches[0]
TRAIN = ArticulatedVehicle(0.3, (Hitch(-0.02, 0.6), Hitch(0.15, 0.4), Hitch(0.0, 0.5)), math.radians(40), 1.2)
angles = st.floats(-1.2, 1.2)
hitches = st.builds(Hitch, offset_m=st.floats(-0.2, 0.2), length_m=st.floats(0.25, 2.0))


@given(st.floats(-0.6, 0.6), st.tuples(angles, angles, angles), st.floats(-1, 1))
def test_rates_are_the_differences_of_poses(steering: float, bending: tuple[float, ...], speed: float) -> None:
    motion = TRAIN.motion(steering, bending, speed)
    h = 1e-6

    def poses(dt: float) -> tuple[Pose, ...]:
        yaw = motion.yaw_rate_rad_s[0] * dt
        truck = Pose(speed * dt * math.cos(yaw / 2), speed * dt * math.sin(yaw / 2), yaw)
        return TRAIN.poses(truck, [b + rate * dt for b, rate in zip(bending, motion.bending_rate_rad_s, strict=True)])

    for unit, (before, after) in enumerate(zip(poses(-h), poses(h), strict=True)):
        heading = (before.yaw_rad + after.yaw_rad) / 2
        vx, vy = (after.x_m - before.x_m) / (2 * h), (after.y_m - before.y_m) / (2 * h)
        along, across = vx * math.cos(heading) + vy * math.sin(heading), vy * math.cos(heading) - vx * math.sin(heading)
        assert across == pytest.approx(0, abs=1e-7), f"axle {unit} slips"
        assert along == pytest.approx(motion.speed_m_s[unit], abs=1e-7)
        turned = (after.yaw_rad - before.yaw_rad) / (2 * h)
        assert turned == pytest.approx(motion.yaw_rate_rad_s[unit], abs=1e-7)


@given(hitches, st.floats(-1.5, 1.5), st.booleans())
def test_the_bending_angle_of_stable_motion_stays(hitch: Hitch, curvature: float, extreme: bool) -> None:
    bending = hitch.stable_bending(curvature, extreme)
    if bending is None:
        assert abs(curvature) >= hitch.turning_curvature * (1 - 1e-12)
        return
    assert hitch.bending_rate(curvature, bending) == pytest.approx(0, abs=1e-7)
    assert (math.cos(bending + math.atan(hitch.offset_m * curvature)) < 0) == extreme


@given(hitches, st.floats(-3, 3))
def test_the_law_for_the_trailers_curvature_is_the_inverse_of_stable_motion(hitch: Hitch, rear: float) -> None:
    front = hitch.front_curvature(rear)
    bending = hitch.bending_for(rear)
    ratio = hitch.speed_ratio(front, bending)
    assert hitch.bending_rate(front, bending) == pytest.approx(0, abs=1e-9)
    assert ratio > 0
    assert front / ratio == pytest.approx(rear, abs=1e-9)


@given(st.floats(-1.0, 1.0))
def test_a_hitch_above_the_axle_is_the_limit_of_hitches_near_it(curvature: float) -> None:
    above, near = Hitch(0.0, 0.615), Hitch(1e-9, 0.615)
    assert above.stable_bending(curvature) == pytest.approx(near.stable_bending(curvature), abs=1e-8)
    assert above.stable_bending(curvature) == pytest.approx(-math.asin(0.615 * curvature), abs=1e-12)


def test_straight_motion_is_an_ordinary_case() -> None:
    assert HITCH.stable_bending(0.0) == 0.0
    assert HITCH.bending_for(0.0) == 0.0
    assert HITCH.stable_bending(0.0, extreme=True) == pytest.approx(-math.pi)


def test_the_turning_angle_is_the_published_one() -> None:
    turning = SEMITRAILER.steering(HITCH.turning_curvature)
    published = math.atan(0.215 / -0.013 * math.tan(math.asin(-0.013 / 0.615)))
    assert turning == pytest.approx(published, abs=1e-12)
    assert math.degrees(turning) == pytest.approx(19.27, abs=0.005)


def test_the_bending_angle_at_the_turning_angle_is_not_the_published_one() -> None:
    assert math.degrees(HITCH.turning_bending_rad) == pytest.approx(88.789, abs=0.001)
    rounded = HITCH.stable_bending(SEMITRAILER.curvature(0.33632))
    assert rounded is not None
    assert math.degrees(-rounded) == pytest.approx(87.64, abs=0.01), "87.64 is what rounding alpha_turn makes of it"


def test_beyond_the_turning_angle_nothing_is_stable() -> None:
    beyond = SEMITRAILER.curvature(math.radians(19.3))
    assert HITCH.stable_bending(beyond) is HITCH.stable_bending(beyond, extreme=True) is None


def test_the_printed_bending_angle_of_stable_motion_has_the_wrong_sign() -> None:
    alpha = math.radians(10)
    phi = math.atan(-0.013 / 0.215 * math.tan(alpha))
    printed = math.asin(0.615 * math.sin(phi) / -0.013) + phi
    assert HITCH.stable_bending(SEMITRAILER.curvature(alpha)) == pytest.approx(-printed, abs=1e-12)


def test_the_extreme_bending_angle_is_built_from_the_radii_put_right() -> None:
    alpha, m, length = math.radians(10), -0.013, 0.615
    r1 = 0.215 / math.tan(alpha)
    r2 = math.sqrt(m * m + r1 * r1 - length * length)
    found = HITCH.stable_bending(SEMITRAILER.curvature(alpha), extreme=True)
    assert found is not None
    assert math.degrees(abs(found)) == pytest.approx(149.10, abs=0.005)
    assert abs(found) == pytest.approx(math.pi - math.atan2(r1, m) + math.atan2(r2, length), abs=1e-12)


def test_steering_beyond_the_turning_angle_leaves_no_bending_to_jackknife() -> None:
    assert SEMITRAILER.bending_limits_rad == (math.pi,)
    assert SEMITRAILER.jackknife_margin([0.4]) == pytest.approx(math.pi - 0.4)


def test_less_steering_cannot_straighten_a_bending_beyond_its_own_stable_motion() -> None:
    truck = ArticulatedVehicle(0.215, (HITCH,), math.radians(15))
    (limit,) = truck.bending_limits_rad
    full = -truck.max_curvature
    assert HITCH.bending_rate(full, limit - 0.01) > 0, "backwards, what grows forwards shrinks"
    assert HITCH.bending_rate(full, limit + 0.01) < 0
    assert truck.jackknife_margin([limit + 0.01]) == pytest.approx(-0.01)


def test_a_truck_alone_has_no_jackknife() -> None:
    assert ArticulatedVehicle(0.2, (), 0.5).jackknife_margin([]) == math.inf


def stable_bendings(curvature: float | None) -> tuple[float, ...] | None:
    """Bending angles of the train where its truck goes on with this curvature; None where a hitch has none."""
    bendings = []
    for hitch in TRAIN.hitches:
        bending = None if curvature is None else hitch.stable_bending(curvature)
        if curvature is None or bending is None:
            return None
        bendings.append(bending)
        curvature = hitch.rear_curvature(curvature)
    return tuple(bendings)


def test_the_stable_limit_of_a_train_is_where_its_first_unit_turns_on_the_spot_or_bends_too_far() -> None:
    curvature = TRAIN.stable_curvature
    inside = stable_bendings(curvature * (1 - 1e-9))
    outside = stable_bendings(curvature * (1 + 1e-6))
    assert inside is not None
    assert max(map(abs, inside)) == pytest.approx(TRAIN.max_bending_rad, abs=1e-6)
    assert outside is None or max(map(abs, outside)) > TRAIN.max_bending_rad


def test_the_tightest_path_backwards_is_that_of_the_bending_limit() -> None:
    truck = ArticulatedVehicle(0.215, (HITCH,), math.radians(32), math.radians(50))
    assert HITCH.bending_for(truck.stable_rear_curvature) == pytest.approx(-math.radians(50))


def test_a_hitch_far_behind_its_axle_makes_the_truck_the_tighter_unit() -> None:
    hitch = Hitch(0.5, 0.3)
    assert hitch.turning_curvature == math.inf
    rear = hitch.rear_curvature(math.inf)
    assert rear == pytest.approx(1 / 0.4)
    assert hitch.front_curvature(2.6) == math.inf
    assert hitch.turning_bending_rad == pytest.approx(-hitch.bending_for(1 / 0.4), abs=1e-6)


@pytest.mark.parametrize(
    ("wheelbase", "hitch", "steering"), [(0.0, HITCH, 0.5), (0.2, Hitch(0, -1), 0.5), (0.2, Hitch(-1, 1), 0.5)]
)
def test_impossible_vehicles_are_refused(wheelbase: float, hitch: Hitch, steering: float) -> None:
    with pytest.raises(ValueError, match=r"length|ahead"):
        ArticulatedVehicle(wheelbase, (hitch,), steering)


def test_a_steering_limit_of_a_quarter_turn_is_refused() -> None:
    with pytest.raises(ValueError, match="steering limit"):
        ArticulatedVehicle(0.2, (), math.pi / 2)
