"""A whole simulated robot on omni-wheels: goals, twists, ice, refusals and stops, over the simulated bus."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import msgspec
import pytest

from canhelm.errors import EmergencyStop, LimitExceeded, Refused, UsageError
from daemon.runtime.omni_motions import OmniMotion
from daemon.runtime.omni_vehicle import OmniVehicle
from drivers.simulated.omni import OmniWorld
from profiles.loader import load
from profiles.schema import FloorPatch, Profile
from vcan_tests.robot import Robot, running_robot

TURTLE = load("turtle").profile


def world_of(robot: Robot) -> OmniWorld:
    assert isinstance(robot.network.world, OmniWorld)
    return robot.network.world


def vehicle_of(robot: Robot) -> OmniVehicle:
    assert isinstance(robot.app.vehicle, OmniVehicle)
    return robot.app.vehicle


def iced(profile: Profile, friction: float) -> Profile:
    """The robot with a strip of ice across its way."""
    assert profile.simulation is not None
    ice = FloorPatch(x_m=0.6, y_m=0.0, length_m=0.8, width_m=3.0, friction=friction)
    simulation = msgspec.structs.replace(profile.simulation, floor={"ice": ice})
    return msgspec.structs.replace(profile, simulation=simulation)


def pose_of(robot: Robot) -> tuple[float, float, float]:
    world = world_of(robot)
    world.advance(asyncio.get_running_loop().time())
    return world.pose


@pytest.mark.parametrize("goal", [(2.0, 0.0, None), (0.0, -1.0, None), (-0.7, 0.7, 90.0), (0.1, 0.0, -170.0)])
async def test_it_drives_to_a_place_and_heading_within_a_centimetre(goal: tuple[float, float, float | None]) -> None:
    x_m, y_m, heading_deg = goal
    async with running_robot(TURTLE) as robot:
        result = await robot.call("drive.to", x_m=x_m, y_m=y_m, heading_deg=heading_deg)
        x, y, yaw = pose_of(robot)
        assert math.hypot(x - x_m, y - y_m) < 0.01
        assert math.remainder(yaw - math.radians(heading_deg or 0.0), math.tau) == pytest.approx(0.0, abs=0.02)
        assert result["result"] == "arrived"
        assert result["error_m"] < 0.003
        assert robot.state == "idle"


async def test_it_takes_the_shortest_time() -> None:
    """2 m at 1.2 m/s and 1.2 m/s2: s/v + v/a."""
    async with running_robot(TURTLE) as robot:
        result = await robot.call("drive.to", x_m=2.0, y_m=0.0)
        assert result["duration_s"] == pytest.approx(2.0 / 1.2 + 1.0, abs=0.1)


async def test_it_passes_the_goal_at_the_wanted_velocity_and_comes_to_rest_behind_it() -> None:
    async with running_robot(TURTLE) as robot:
        driving = asyncio.create_task(robot.call("drive.to", x_m=1.0, y_m=0.3, end_vx_m_s=0.6, end_vy_m_s=0.0))
        await robot.until(lambda: pose_of(robot)[0] >= 1.0)
        vx, vy, _ = world_of(robot).velocity
        assert (vx, vy) == pytest.approx((0.6, 0.0), abs=0.06)
        assert pose_of(robot)[1] == pytest.approx(0.3, abs=0.015)
        result = await driving
        assert result["error_m"] < 0.02
        assert pose_of(robot)[0] == pytest.approx(1.0 + 0.6**2 / (2 * 1.2), abs=0.05)


async def test_parallel_movement_ends_where_speed_times_duration_says() -> None:
    async with running_robot(TURTLE) as robot:
        await robot.call("drive.parallel", angle_deg=60.0, speed_m_s=-0.5, duration_s=2.0)
        x, y, yaw = pose_of(robot)
        assert (x, y, yaw) == pytest.approx((-0.5, -math.sqrt(3) / 2, 0.0), abs=0.01)


async def test_it_turns_on_the_spot_for_a_time() -> None:
    async with running_robot(TURTLE) as robot:
        await robot.call("drive.rotate", rate_deg_s=60.0, duration_s=1.5)
        x, y, yaw = pose_of(robot)
        assert math.degrees(yaw) == pytest.approx(90.0, abs=2.0)
        assert (x, y) == pytest.approx((0.0, 0.0), abs=0.005)


async def test_a_turn_without_end_lasts_until_its_client_stops_it() -> None:
    async with running_robot(TURTLE) as robot:
        turning = asyncio.create_task(robot.call("drive.rotate", rate_deg_s=45.0))
        await robot.until(lambda: pose_of(robot)[2] > 1.0)
        await robot.call("stop")
        with pytest.raises(Refused, match="stop was commanded"):
            await turning
        assert robot.speed_m_s < 0.01


async def test_a_stream_of_twists_drives_a_circle_and_a_stale_one_stops() -> None:
    async with running_robot(TURTLE) as robot:
        for _ in range(60):
            await robot.call("drive.set", direction_deg=0.0, speed_m_s=0.4, yaw_rate_deg_s=57.2958, valid_for_ms=200)
            await asyncio.sleep(0.05)
        vx, vy, rate = world_of(robot).velocity
        assert (vx, vy, rate) == pytest.approx((0.4, 0.0, 1.0), abs=0.05)
        took = await robot.until(lambda: robot.speed_m_s < 0.01)
        assert took < 0.2 + 0.4 / 1.2 + 0.2
        assert robot.state == "active"
        await robot.until(lambda: robot.state == "idle")


@pytest.mark.parametrize(
    ("rate_deg_s", "speed_m_s", "direction_deg"),
    [(90.0, 0.0, 0.0), (-90.0, 0.0, 0.0), (90.0, 1.0, -120.0), (0.0, 1.2, 180.0)],
)
@pytest.mark.parametrize("stopped", [True, False], ids=["stopped", "silent"])
async def test_after_a_fast_twist_it_comes_to_rest_by_its_ramp_and_stays(
    stopped: bool, rate_deg_s: float, speed_m_s: float, direction_deg: float
) -> None:
    """On floor that grips nothing is taken for slip, however much the samples of the accelerometer miss."""
    twist = {"yaw_rate_deg_s": rate_deg_s, "speed_m_s": speed_m_s, "direction_deg": direction_deg}
    async with running_robot(TURTLE, seed=2) as robot:
        slips: list[bool] = []
        robot.app.supervisor.observers.append(lambda: slips.append(vehicle_of(robot).senses.slipping))
        for _ in range(80):
            driven = await robot.call("drive.set", **twist, valid_for_ms=200)
            await asyncio.sleep(0.05)
        stopping = asyncio.create_task(robot.call("motion.stop", motion=driven["motion"])) if stopped else None
        await asyncio.sleep(max(abs(rate_deg_s) / 120.0, speed_m_s / 1.2) + (0.0 if stopped else 0.15) + 0.3)
        at_rest = pose_of(robot)
        assert abs(world_of(robot).velocity[2]) < 0.02
        await asyncio.sleep(2.0)
        assert pose_of(robot) == pytest.approx(at_rest, abs=0.002)
        assert not any(slips)
        if stopping is not None:
            await stopping


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"x_m": 1e5}, "x_m is 100000: not a finite number, or too large"),
        ({"heading_deg": 1e9}, "heading_deg is 1e+09: not a finite number, or too large"),
        ({"end_vy_m_s": -1e9}, "end_vy_m_s is -1e+09: not a finite number, or too large"),
        ({"speed_m_s": 0.0}, "speed_m_s is 0: not positive"),
    ],
)
async def test_which_number_of_a_goal_cannot_be_is_told(given: dict[str, float], told: str) -> None:
    async with running_robot(TURTLE) as robot:
        with pytest.raises(UsageError) as refused:
            await robot.call("drive.to", **{"x_m": 1.0, "y_m": 0.0, **given})
        assert refused.value.message == told


@pytest.mark.parametrize(
    ("method", "params", "error"),
    [
        ("drive.to", {"x_m": math.nan, "y_m": 0.0}, UsageError),
        ("drive.to", {"x_m": 1.0, "y_m": math.inf}, UsageError),
        ("drive.to", {"x_m": 1.0, "y_m": 1e9}, UsageError),
        ("drive.to", {"x_m": 1.0, "y_m": 0.0, "heading_deg": math.nan}, UsageError),
        ("drive.to", {"x_m": 1.0, "y_m": 0.0, "speed_m_s": 9.0}, LimitExceeded),
        ("drive.to", {"x_m": 1.0, "y_m": 0.0, "speed_m_s": -1.0}, UsageError),
        ("drive.to", {"x_m": 1.0, "y_m": 0.0, "end_vx_m_s": 1.0, "end_vy_m_s": 1.0}, LimitExceeded),
        ("drive.to", {"x_m": 99999.0, "y_m": 0.0}, LimitExceeded),
        ("drive.parallel", {"angle_deg": 0.0, "speed_m_s": 9.0, "duration_s": 1.0}, LimitExceeded),
        ("drive.rotate", {"rate_deg_s": 400.0, "duration_s": 1.0}, LimitExceeded),
        ("drive.set", {"direction_deg": 0.0, "speed_m_s": 3.0, "valid_for_ms": 300}, LimitExceeded),
        ("drive.turn", {"rear_deg": 0.0, "front_deg": 3.0, "speed_m_s": 0.1, "duration_s": 1.0}, Refused),
    ],
)
async def test_what_is_refused_moves_nothing(method: str, params: dict[str, Any], error: type[Exception]) -> None:
    async with running_robot(TURTLE) as robot:
        with pytest.raises(error):
            await robot.call(method, **params)
        await asyncio.sleep(0.2)
        assert pose_of(robot) == (0.0, 0.0, 0.0)
        assert robot.state == "idle"


async def test_stop_in_mid_way_brings_it_to_rest_by_the_quick_stop_ramp() -> None:
    async with running_robot(TURTLE) as robot:
        driving = asyncio.create_task(robot.call("drive.to", x_m=3.0, y_m=0.0))
        await robot.until(lambda: robot.speed_m_s > 1.15)
        begin = asyncio.get_running_loop().time()
        await robot.call("stop")
        assert asyncio.get_running_loop().time() - begin < 1.2 / 2.4 + 0.3
        assert robot.speed_m_s < 0.01
        with pytest.raises(Refused, match="stop was commanded"):
            await driving
        assert (await robot.call("drive.to", x_m=0.0, y_m=0.0))["error_m"] < 0.003


async def test_an_emergency_stop_in_mid_way_is_latched() -> None:
    async with running_robot(TURTLE, expect_errors=True) as robot:
        driving = asyncio.create_task(robot.call("drive.to", x_m=3.0, y_m=0.0))
        await robot.until(lambda: robot.speed_m_s > 0.5)
        await robot.call("estop")
        with pytest.raises(EmergencyStop):
            await driving
        await robot.until(lambda: robot.speed_m_s < 0.01)
        with pytest.raises(EmergencyStop):
            await robot.call("drive.to", x_m=0.0, y_m=0.0)


async def test_a_client_that_falls_silent_loses_the_motion_by_its_ramp() -> None:
    async with running_robot(TURTLE) as robot:
        driving = asyncio.create_task(robot.call("drive.to", x_m=4.0, y_m=0.0))
        await robot.until(lambda: robot.speed_m_s > 1.0)
        await robot.fall_silent()
        took = await robot.until(lambda: robot.speed_m_s < 0.01)
        assert took < 1.5 + 1.2 / 1.2 + 0.3
        with pytest.raises(Refused, match="lease"):
            await driving


async def test_every_step_tells_case_limits_and_time_left() -> None:
    async with running_robot(TURTLE) as robot:
        driving = asyncio.create_task(robot.call("drive.to", x_m=2.0, y_m=0.0))
        await robot.until(lambda: robot.speed_m_s > 1.19)
        (motion,) = robot.app.service.status()["motions"]
        assert motion["case"] == "cruise"
        assert motion["phase"] == "moving"
        assert motion["acceleration_limit_m_s2"] == pytest.approx(1.2)
        assert 0.9 < motion["eta_s"] < 1.8
        assert motion["safety_factor"] == 1.0
        await driving


async def test_the_acceleration_of_the_centre_comes_over_the_bus_free_of_the_sensors_place() -> None:
    """Turning on the spot the centre stays, whatever the sensor on the side feels."""
    async with running_robot(TURTLE) as robot:
        turning = asyncio.create_task(robot.call("drive.rotate", rate_deg_s=90.0, duration_s=3.0))
        await robot.until(lambda: world_of(robot).velocity[2] > 1.5)
        await asyncio.sleep(0.5)
        sums, readings = [0.0, 0.0], 0

        def look() -> None:
            nonlocal readings
            acceleration = vehicle_of(robot).senses.centre
            assert acceleration is not None
            sums[0], sums[1], readings = (
                sums[0] + acceleration.centre[0],
                sums[1] + acceleration.centre[1],
                readings + 1,
            )
            assert math.hypot(*acceleration.point) > 0.2

        robot.app.supervisor.observers.append(look)
        await asyncio.sleep(1.0)
        robot.app.supervisor.observers.remove(look)
        assert math.hypot(*sums) / readings < 0.05
        await turning


async def test_an_ice_patch_makes_slip_that_the_loop_detects_and_answers() -> None:
    async with running_robot(iced(TURTLE, 0.04)) as robot:
        slid = 0
        motions: list[OmniMotion] = []

        def look() -> None:
            nonlocal slid
            slid += any(world_of(robot).sliding)
            motions[:] = [*motions, *(m for m in robot.app.supervisor.motions.values() if isinstance(m, OmniMotion))][
                :1
            ]

        robot.app.supervisor.observers.append(look)
        result = await robot.call("drive.to", x_m=2.0, y_m=0.0)
        assert slid > 5
        assert result["slip_steps"] > 0
        assert result["least_safety_factor"] < 0.7
        assert motions[0].record is not None


async def test_without_ice_nothing_slips_and_the_safety_factor_stays() -> None:
    async with running_robot(TURTLE) as robot:
        for goal in ((1.5, 0.0, 0.0), (0.0, 1.0, 90.0), (0.0, 0.0, 0.0)):
            result = await robot.call("drive.to", x_m=goal[0], y_m=goal[1], heading_deg=goal[2])
            assert (result["slip_steps"], result["least_safety_factor"]) == (0, 1.0)


@pytest.mark.parametrize(("farthest_m", "refused"), [(0.5, True), (0.51, False)])
async def test_how_far_away_a_goal_may_be_its_profile_says(farthest_m: float, refused: bool) -> None:
    limits = msgspec.structs.replace(TURTLE.limits, goal_distance_m=farthest_m)
    async with running_robot(msgspec.structs.replace(TURTLE, limits=limits)) as robot:
        told = await robot.begin("drive.to", x_m=0.4, y_m=-0.31)
        assert ("goal_distance_m 0.5" in str(getattr(told, "limit", ""))) is refused


async def test_a_robot_with_neither_accelerometer_nor_traction_drives_without_the_loop() -> None:
    drives = {name: msgspec.structs.replace(drive, analog_inputs=False) for name, drive in TURTLE.drives.items()}
    plain = msgspec.structs.replace(TURTLE, accelerometer=None, traction=None, drives=drives)
    async with running_robot(plain) as robot:
        result = await robot.call("drive.to", x_m=0.5, y_m=0.5)
        assert result["error_m"] < 0.003
        assert robot.app.service.status()["vehicle"]["acceleration_m_s2"] is None


async def test_it_drives_behind_a_serial_line() -> None:
    async with running_robot(TURTLE, bus="rs232") as robot:
        result = await robot.call("drive.to", x_m=0.6, y_m=-0.3, heading_deg=30.0)
        assert result["error_m"] < 0.02
        assert not vehicle_of(robot).senses.observing


async def test_one_motor_turns_by_itself() -> None:
    async with running_robot(TURTLE) as robot:
        await robot.call("motor.velocity", node="wheel_2", velocity_rpm=300.0, duration_s=0.5)
        assert robot.fastest_wheel_m_s < 0.01
        assert robot.state == "idle"


async def test_a_profiles_jerk_limit_is_kept_by_drive_to() -> None:
    limits = msgspec.structs.replace(TURTLE.limits, jerk_m_s3=4.0)
    async with running_robot(msgspec.structs.replace(TURTLE, limits=limits)) as robot:
        accelerations = [0.0]

        def look() -> None:
            motions = [motion for motion in robot.app.supervisor.motions.values() if isinstance(motion, OmniMotion)]
            records = [motion.record for motion in motions if motion.record]
            accelerations.extend(record.guidance.acceleration_m_s2[0] for record in records)

        robot.app.supervisor.observers.append(look)
        result = await robot.call("drive.to", x_m=2.0, y_m=0.0)
        changes = [abs(new - old) for new, old in zip(accelerations[1:], accelerations, strict=False)]
        assert max(changes) <= 0.04 * (1 + 1e-6)
        assert result["error_m"] < 0.003
        assert result["least_safety_factor"] == 1.0


def without_accelerometer() -> Profile:
    """The turtle with drives whose currents tell slip: without a ramp of their own in each cycle."""
    drives = {
        name: msgspec.structs.replace(drive, analog_inputs=False, mode="velocity")
        for name, drive in TURTLE.drives.items()
    }
    return msgspec.structs.replace(TURTLE, accelerometer=None, drives=drives)


@pytest.mark.parametrize("goal", [(3.0, 0.0, 0.0), (-1.5, 1.2, 0.0), (1.5, 0.5, 150.0)])
async def test_without_accelerometer_dry_floor_is_not_taken_for_ice(goal: tuple[float, float, float]) -> None:
    async with running_robot(without_accelerometer()) as robot:
        result = await robot.call("drive.to", x_m=goal[0], y_m=goal[1], heading_deg=goal[2])
        assert (result["slip_steps"], result["least_safety_factor"]) == (0, 1.0)
        assert result["error_m"] < 0.003


async def test_without_accelerometer_the_currents_tell_slip_and_the_loop_answers() -> None:
    asides = []
    for observing in (False, True):
        async with running_robot(iced(without_accelerometer(), 0.08)) as robot:
            vehicle_of(robot).senses.observing = observing
            result = await robot.call("drive.to", x_m=3.0, y_m=0.0)
            asides.append(abs(pose_of(robot)[1]))
            assert (result["slip_steps"] > 0) is observing
    assert asides[1] < 0.8 * asides[0]


async def test_a_robot_that_pushes_a_wall_holds_its_wheels_near_their_best_pull(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A wall is no ice: the factor stays, and no wheel spins at the half metre a second that is commanded."""
    async with running_robot(TURTLE) as robot:
        world, vehicle = world_of(robot), vehicle_of(robot)
        slips: list[float] = []
        pushing: list[bool] = []
        free = world._move

        def against_a_wall(force_x: float, force_y: float, yaw_acceleration: float, dt: float) -> None:
            (x, _, yaw), (vx, _, rate) = world.pose, world.velocity
            flat = (4e4 * (x - 0.4) + 600.0 * vx, 400.0 * yaw + 40.0 * rate) if x > 0.4 else (0.0, 0.0)
            free(force_x - flat[0], force_y, yaw_acceleration - flat[1], dt)

        def look() -> None:
            slips.append(max(map(abs, world.slip_m_s)))
            pushing.append(vehicle.senses.pushing)

        monkeypatch.setattr(world, "_move", against_a_wall)
        driving = asyncio.create_task(robot.call("drive.to", x_m=2.0, y_m=0.0, speed_m_s=0.5))
        await robot.until(lambda: vehicle.senses.pushing)
        await asyncio.sleep(0.3)
        robot.app.supervisor.observers.append(look)
        await asyncio.sleep(1.0)
        robot.app.supervisor.observers.remove(look)
        (motion,) = robot.app.service.status()["motions"]
        await robot.call("stop")
        with pytest.raises(Refused):
            await driving
    assert sum(pushing) > 0.5 * len(pushing)
    assert max(slips) < 0.3
    assert motion["safety_factor"] == 1.0
