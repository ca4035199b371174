"""A whole simulated robot and each kind of fault: what the daemon sees, says and does, and what gets it going again."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from math import degrees
from typing import Any

import pytest

from canhelm.errors import CanhelmError, DeviceFault
from drivers.contract import DriveState
from drivers.simulated.max2d import Max2dWorld
from profiles.loader import load
from vcan_tests.daemon.nxt_twin import NXT
from vcan_tests.robot import Robot, running_robot

MAX2D = load("max2d").profile
REST_S = 1.5
"""From a fault at 0.4 m/s until every wheel stands: noticing it, and the quick-stop ramp, with a margin."""
TOLD_S, SILENT_S, GUARDED_S = 0.011, 0.071, 0.19
"""Until a fault is noticed: that a device tells itself, that it is silent, that it answers no guarding, right after an
answer."""
LIFE_TIME_S, SWING_S = 0.3, 0.05
"""Until a drive that hears nothing begins its ramp by itself; and what a wheel swings after it."""
OFF_OTHERWISE_S = 2.5
"""Until a drive is off that has to be told by SDO, or restarted: its ramp from full speed, and requests in vain."""
RAMP_S = 0.4 / min(drive.quick_stop_m_s2 for drive in MAX2D.drives.values())


@asynccontextmanager
async def _struck(**fault: Any) -> AsyncIterator[tuple[Robot, asyncio.Task[Any]]]:
    """A robot that was driving when a fault struck it, and its motion."""
    async with running_robot(expect_errors=True) as robot:
        driving = robot.begin("drive.parallel", angle_deg=0.0, speed_m_s=0.4, duration_s=2.0)
        await robot.until(lambda: robot.speed_m_s > 0.38)
        await robot.call("simulation.fault", **fault)
        yield robot, driving


STOPS: list[tuple[dict[str, Any], str, float]] = [
    ({"kind": "lose", "part": "front_left"}, "node 3 (front_left) is silent", SILENT_S),
    ({"kind": "lose", "cob_id": 0x080}, "no node answers", SILENT_S),
    ({"kind": "lose", "cob_id": 0x703}, "node 3 (front_left) is lost: no guarding answer", GUARDED_S),
    ({"kind": "delay", "cob_id": 0x183, "delay_s": 0.2}, "node 3 (front_left) is silent", SILENT_S),
    ({"kind": "pdo_short", "cob_id": 0x183}, "node 3 (front_left) is silent", SILENT_S),
    ({"kind": "pdo_short", "part": "front"}, "node 6 (front) is silent", SILENT_S),
    ({"kind": "pdo_long", "part": "front"}, "node 6 (front) is silent", SILENT_S),
    ({"kind": "node_reset", "part": "front_left"}, "node 3 (front_left)", SILENT_S),
    ({"kind": "node_reset", "part": "front"}, "node 6 (front)", SILENT_S),
    ({"kind": "communication_reset", "part": "front_left"}, "node 3 (front_left)", SILENT_S),
    ({"kind": "communication_reset", "part": "front"}, "node 6 (front)", SILENT_S),
    ({"kind": "power_cycle", "part": "front_left"}, "node 3 (front_left)", SILENT_S),
    ({"kind": "silence", "part": "front_left"}, "node 3 (front_left) is silent", SILENT_S),
    ({"kind": "silence", "part": "front"}, "node 6 (front) is silent", SILENT_S),
    ({"kind": "babbling", "part": "front_left"}, "no node answers", SILENT_S),
    ({"kind": "emcy", "part": "front_left", "code": 0x4210}, "node 3 (front_left) reports over-temperature", TOLD_S),
    ({"kind": "emcy", "part": "front_left", "code": 0x1234}, "node 3 (front_left) reports emergency 0x1234", TOLD_S),
    ({"kind": "emcy", "part": "front", "code": 0x5000}, "node 6 (front) reports position error", TOLD_S),
    ({"kind": "bus_off"}, "vcan0 does not work: its controller is bus-off", SILENT_S),
    ({"kind": "unplugged"}, "vcan0 does not work: the adapter is unplugged", SILENT_S),
]


@pytest.mark.parametrize(
    ("fault", "told", "noticed_s"), STOPS, ids=[" ".join(map(str, fault.values())) for fault, *_ in STOPS]
)
async def test_a_fault_while_driving_stops_the_robot_by_name_and_a_reset_gets_it_going(
    fault: dict[str, Any], told: str, noticed_s: float
) -> None:
    async with _struck(**fault) as (robot, driving):
        await robot.until(lambda: robot.state == "fault", noticed_s)
        await robot.until(lambda: robot.fastest_wheel_m_s < 0.01, LIFE_TIME_S - noticed_s + RAMP_S + SWING_S)
        error = await driving
        assert isinstance(error, DeviceFault)
        assert told in error.message
        assert error.remedy
        assert (await robot.call("simulation.faults"))["faults"][0]["struck"] > 0
        await robot.call("simulation.clear_faults")
        await asyncio.sleep(fault.get("delay_s", 0.0))
        await robot.until(lambda: all(device.node_state == "ready" for device in robot.app.devices.all))
        assert (await robot.call("reset"))["state"] == "idle"
        await robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.2, duration_s=0.3)


async def test_a_motion_that_a_fault_has_ended_is_told_as_stopping_until_its_drives_are_off() -> None:
    async with _struck(kind="silence", part="front_left") as (robot, driving):
        await robot.until(lambda: robot.state == "fault")
        (motion,) = robot.app.service.status()["motions"]
        assert motion.keys() == {"motion", "kind", "drives", "phase"}
        assert motion["phase"] == "stopping"
        await driving


async def test_what_a_motion_ends_by_in_a_fault_names_the_reset() -> None:
    async with _struck(kind="silence", part="front_left") as (_, driving):
        assert (await driving).remedy.endswith("; then `canhelm reset`")


async def test_a_lost_drive_that_still_hears_is_stopped_at_once_and_not_by_its_life_guarding() -> None:
    async with _struck(kind="lose", cob_id=0x703) as (robot, driving):
        await robot.call("simulation.fault", kind="lose", cob_id=0x583)
        await robot.until(lambda: robot.state == "fault")
        motion = robot.network.drives["front_left"].motion
        speed = motion.demand_speed
        assert await robot.until(lambda: motion.demand_speed < speed) < TOLD_S
        await driving


async def test_a_silent_drive_is_stopped_by_sdo_though_its_motion_is_over_before() -> None:
    async with running_robot(expect_errors=True) as robot:
        steering = robot.begin("steer", pair="front", angle_deg=15.0)
        await robot.until(lambda: robot.app.devices.drives["front_left"].state is DriveState.ENABLED)
        await robot.call("simulation.fault", kind="pdo_short", part="front_left")
        await robot.until(lambda: robot.state == "fault")
        await asyncio.sleep(0.1)
        told = [event["message"] for event in robot.app.supervisor.log.events]
        assert "node 3 (front_left) does not follow its PDOs and was stopped by SDO" in told
        await steering


@pytest.mark.parametrize("command", ["stop", "estop"])
@pytest.mark.parametrize(
    "fault", [{"kind": "lose", "cob_id": 0x203}, {"kind": "pdo_long", "part": "front_left"}], ids=["lost", "too long"]
)
async def test_a_drive_that_gets_no_pdos_is_stopped_and_switched_off_by_sdo(
    fault: dict[str, Any], command: str
) -> None:
    async with _struck(**fault) as (robot, driving):
        await robot.call("simulation.fault", kind="lose", cob_id=0x403)
        stopping = robot.begin(command)
        await robot.until(lambda: robot.fastest_wheel_m_s < 0.01, REST_S)
        await driving
        await robot.until(lambda: not robot.network.drives["front_left"].motion.powered, 4.0)
        await stopping
        told = [event["message"] for event in robot.app.supervisor.log.events]
        assert [words for words in told if words.startswith("node 3 (front_left) does not follow its PDOs")]
        assert robot.state == ("estop" if command == "estop" else "fault")


async def test_a_motion_whose_drive_gets_no_pdos_ends_in_a_fault_with_the_drive_off() -> None:
    async with _struck(kind="lose", cob_id=0x203) as (robot, driving):
        await driving
        assert robot.state == "fault"
        assert "does not follow its PDOs" in robot.app.service.status()["message"]
        assert not robot.network.drives["front_left"].motion.powered
        await robot.until(lambda: robot.fastest_wheel_m_s < 0.01, REST_S)


async def test_a_drive_that_can_be_told_nothing_is_switched_off_by_restarting_its_node() -> None:
    async with running_robot(expect_errors=True) as robot:
        await robot.call("motor.enable", node=3)
        await robot.call("simulation.fault", kind="lose", cob_id=0x203)
        await robot.call("simulation.fault", kind="sdo_abort", part="front_left")
        await robot.begin("motor.disable", node=3)
        await robot.until(lambda: not robot.network.drives["front_left"].motion.powered, 0.1)
        told = [event["message"] for event in robot.app.supervisor.log.events]
        assert "node 3 (front_left) does not follow its PDOs and was switched off by restarting its node" in told


@pytest.mark.parametrize(
    "fault",
    [
        {"kind": "sdo_abort", "object": "0x6040"},
        {"kind": "sdo_timeout", "object": "0x6040"},
        {"kind": "sdo_abort", "object": "0x6041"},
        {"kind": "sdo_abort", "object": "0x1018/1"},
    ],
    ids=lambda fault: " ".join(fault.values()),
)
async def test_a_drive_that_has_forgotten_its_guarding_is_switched_off_though_it_refuses_requests(
    fault: dict[str, Any],
) -> None:
    async with _struck(part="front_left", **fault) as (robot, driving):
        await robot.call("simulation.fault", kind="communication_reset", part="front_left")
        await robot.until(lambda: not robot.network.drives["front_left"].motion.powered, OFF_OTHERWISE_S)
        await driving
        await robot.call("simulation.clear_faults")
        await robot.until(lambda: all(device.node_state == "ready" for device in robot.app.devices.all))
        assert (await robot.call("reset"))["state"] == "idle"


async def test_drives_that_have_all_forgotten_their_guarding_are_stopped_at_once_and_not_one_after_the_other() -> None:
    async with _struck(kind="communication_reset", part="front") as (robot, driving):
        robot.app.master.pacing.turns = asyncio.Semaphore(1)
        for part in ("rear", "rear_right", "rear_left", "front_left", "front_right"):
            await robot.call("simulation.fault", kind="communication_reset", part=part)
        await robot.until(lambda: robot.fastest_wheel_m_s < 0.01, SILENT_S + RAMP_S + SWING_S)
        await driving
        await robot.until(lambda: not any(drive.motion.powered for drive in robot.network.drives.values()), 2.5)
        await robot.until(lambda: all(device.node_state == "ready" for device in robot.app.devices.all))


@pytest.mark.parametrize(
    "fault",
    [
        {"kind": "delay", "delay_s": 0.002},
        {"kind": "duplicate"},
        {"kind": "reorder", "probability": 0.2},
        {"kind": "lose", "probability": 0.005},
        {"kind": "encoder_noise", "part": "front_left", "angle_deg": 0.2},
    ],
    ids=lambda fault: fault["kind"],
)
async def test_a_robot_drives_on_where_a_fault_is_small(fault: dict[str, Any]) -> None:
    async with _struck(**fault) as (robot, driving):
        assert "motion" in await driving
        assert (await robot.call("simulation.faults"))["faults"][0]["struck"] > 0
        assert robot.fastest_wheel_m_s < 0.01


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        (
            {"kind": "sdo_abort", "object": "0x6060", "code": 0x06090030},
            "0x6060 (mode_of_operation): value out of range",
        ),
        ({"kind": "sdo_abort"}, "refused access to 0x1000 (device_type): general error (0x08000000)"),
        ({"kind": "sdo_timeout", "object": "0x1018/1"}, "checking its identity"),
        ({"kind": "sdo_timeout", "object": "0x1000/0"}, "no SDO answer since its boot-up; is it still powered?"),
        ({"kind": "wrong_identity"}, "another kind of device stands on this one"),
        ({"kind": "wrong_identity", "object": "0x1018/1", "value": 7}, "0x1018/1 (vendor_id)"),
        ({"kind": "power_cycle", "for_s": 3.0}, "no boot-up; is motor power on?"),
    ],
    ids=["abort", "abort of all", "time-out", "never an answer", "device type", "vendor", "power"],
)
async def test_a_fault_at_boot_is_told_with_its_node_and_mended_when_it_is_gone(
    fault: dict[str, Any], told: str
) -> None:
    async with running_robot(booted=False, expect_errors=True) as robot:
        await robot.call("simulation.fault", part="front_left", **fault)
        await robot.until(lambda: told in str(robot.app.service.status()), 5.0)
        assert "node 3 (front_left)" in robot.app.service.status()["message"]
        assert robot.state in ("waiting", "booting")
        await robot.call("simulation.clear_faults")
        await robot.until(lambda: robot.state == "idle", 5.0)


async def test_a_drive_whose_temperature_stays_high_is_not_reset_until_it_has_cooled_down() -> None:
    async with running_robot(expect_errors=True) as robot:
        await robot.call("simulation.fault", kind="emcy", part="front_left", code=0x4210, for_s=2.0)
        await robot.until(lambda: robot.state == "fault")
        with pytest.raises(DeviceFault, match="over-temperature"):
            await robot.call("reset")
        await asyncio.sleep(2.0)
        assert (await robot.call("reset"))["state"] == "idle"


# Steering: what the robot's encoders, brakes and motors do to it


async def _steered(robot: Robot, fault: dict[str, Any]) -> tuple[Any, float]:
    """What steering the front pair to 30 degrees comes to, and its true heading then."""
    await robot.call("simulation.fault", **fault)
    answer = await robot.begin("steer", pair="front", angle_deg=30.0)
    return answer, degrees(robot.network.world.heading_rad("front"))


@pytest.mark.parametrize("fault", ["encoder_stuck", "encoder_reversed"])
async def test_a_pair_whose_encoder_does_not_tell_its_heading_is_stopped_by_name(fault: str) -> None:
    async with running_robot(expect_errors=True) as robot:
        answer, _ = await _steered(robot, {"kind": fault, "part": "front"})
        assert isinstance(answer, CanhelmError)
        assert "front" in answer.message
        await robot.until(lambda: robot.fastest_wheel_m_s < 0.01, REST_S)


async def test_an_encoder_that_jumps_leads_a_pair_astray_by_so_much() -> None:
    async with running_robot(expect_errors=True) as robot:
        await robot.call("steer", pair="front", angle_deg=10.0)
        await robot.call("simulation.fault", kind="encoder_jump", part="front", angle_deg=8.0)
        await asyncio.sleep(0.1)
        told_deg = robot.app.devices.encoders["front"].heading_rad
        assert degrees(told_deg - robot.network.world.heading_rad("front")) == pytest.approx(8.0, abs=0.1)


async def test_a_brake_that_does_not_open_keeps_its_pair_where_it_is() -> None:
    async with running_robot(expect_errors=True) as robot:
        answer, heading_deg = await _steered(robot, {"kind": "brake_stuck", "part": "front"})
        assert isinstance(answer, DeviceFault)
        assert "(front_left) has 5 A in vain" in answer.message
        assert "brake" in (answer.remedy or "")
        assert heading_deg == pytest.approx(0.0, abs=0.1)


async def test_a_brake_that_does_not_hold_lets_its_pair_be_pushed_until_it_is_mended() -> None:
    async with running_robot(expect_errors=True) as robot:
        await robot.call("simulation.fault", kind="brake_slips", part="front")
        assert (await robot.call("simulation.hand", name="front", angle_deg=5.0))["turned_deg"] == 5.0
        await robot.call("simulation.clear_faults")
        assert (await robot.call("simulation.hand", name="front", angle_deg=5.0))["turned_deg"] == 0.0


async def test_a_blocked_motor_does_not_turn_whatever_its_drive_does() -> None:
    async with running_robot(expect_errors=True) as robot:
        await robot.call("simulation.fault", kind="motor_blocked", part="front_left")
        driving = robot.begin("motor.velocity", node=3, velocity_rpm=500.0, duration_s=1.0)
        await robot.until(lambda: robot.app.devices.drives["front_left"].current_a > 1.0)
        assert robot.network.world.axes["front_left"].speed_rad_s == 0.0
        await driving


async def test_a_wheel_on_ice_slips() -> None:
    async with running_robot(expect_errors=True) as robot:
        world = robot.network.world
        assert isinstance(world, Max2dWorld)
        await robot.call("simulation.fault", kind="ice", part="front_left")
        driving = robot.begin("drive.parallel", angle_deg=0.0, speed_m_s=0.4, duration_s=0.5)
        slips: list[tuple[float, ...]] = []
        robot.app.supervisor.observers.append(lambda: slips.append(tuple(map(abs, world.slip_m_s))))
        await driving
        worst = dict(zip(world.wheels, map(max, zip(*slips, strict=True)), strict=True))
        assert max(worst, key=worst.__getitem__) == "front_left"


@pytest.mark.parametrize("kind", ["encoder_stuck", "encoder_jump"])
async def test_a_motor_with_a_broken_encoder_is_whole_again_when_the_fault_is_cleared(kind: str) -> None:
    async with running_robot(expect_errors=True) as robot:
        angle = {"angle_deg": 90.0} if kind == "encoder_jump" else {}
        drive, axis = robot.network.drives["front_left"], robot.network.world.axes["front_left"]
        await robot.call("simulation.lift", lifted=True)
        await robot.call("simulation.fault", kind=kind, part="front_left", **angle)
        before_rad = axis.position_rad
        assert drive.motion.axis is not axis
        await robot.begin("motor.velocity", node=3, velocity_rpm=100.0, duration_s=0.3)
        assert abs(axis.position_rad - before_rad) > 0.1
        await robot.call("simulation.clear_faults")
        assert drive.motion.axis is axis
        await asyncio.sleep(0.5)
        result = await robot.call("motor.velocity", node=3, velocity_rpm=100.0, duration_s=0.5)
        assert result


async def test_a_motor_that_runs_away_is_not_left_running() -> None:
    async with running_robot(expect_errors=True) as robot:
        await robot.call("simulation.lift", lifted=True)
        await robot.call("simulation.fault", kind="encoder_reversed", part="front_left")
        error = await robot.begin("motor.velocity", node=3, velocity_rpm=100.0, duration_s=0.5)
        assert isinstance(error, DeviceFault)
        assert "front_left" in error.message
        assert error.remedy
        assert not robot.network.drives["front_left"].motion.powered


# Serial lines and bricks


@pytest.mark.parametrize("fault", [{"kind": "serial_noise", "probability": 0.05}, {"kind": "unplugged"}])
async def test_a_serial_line_that_fails_stops_the_robot(fault: dict[str, Any]) -> None:
    async with running_robot(bus="rs232", expect_errors=True) as robot:
        driving = robot.begin("drive.parallel", angle_deg=0.0, speed_m_s=0.2, duration_s=20.0)
        await robot.until(lambda: robot.speed_m_s > 0.15)
        await robot.call("simulation.fault", **fault)
        error = await driving
        assert isinstance(error, DeviceFault)
        assert error.remedy
        await robot.until(lambda: robot.fastest_wheel_m_s < 0.01, 10.0)


async def test_a_brick_out_of_range_is_told_and_comes_back() -> None:
    async with running_robot(NXT, expect_errors=True) as robot:
        await robot.call("simulation.fault", kind="brick_lost", part="nxt", for_s=2.0)
        await robot.until(lambda: robot.state == "waiting", 2.0)
        assert "nxt" in robot.app.service.status()["message"]
        await robot.until(lambda: robot.state == "idle")


# What is refused
