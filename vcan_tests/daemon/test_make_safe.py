"""What a killed daemon leaves behind is made safe over the bus alone."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import msgspec
import pytest

from canhelm.errors import BusOff, ConfigError
from daemon.cli.main import main
from daemon.cli.make_safe import secure
from drivers.bus.python_can import PythonCanBus
from drivers.canopen.master import Master
from drivers.contract import BrakeState
from drivers.epos.objects import OBJECTS
from profiles.kept import keep
from profiles.loader import load
from profiles.schema import BrakeConfig, Profile
from vcan_tests.robot import Robot, running_robot

LIFE_TIME_S = 0.3


@asynccontextmanager
async def killed(robot: Robot) -> AsyncIterator[Master]:
    """The daemon is off the bus as if it were dead; another master is there."""
    app = robot.app
    assert app.medium is not None
    await app.bus.close()
    master = Master(app.medium.port("clean-up"), app.profile.network)
    await master.start()
    yield master
    await master.close()


async def _drive(robot: Robot) -> asyncio.Task[dict[str, object]]:
    driving = asyncio.create_task(robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.5, duration_s=60.0))
    await robot.until(lambda: robot.speed_m_s > 0.49)
    return driving


async def _release_front_brake_by_steering(robot: Robot) -> asyncio.Task[dict[str, object]]:
    steering = asyncio.create_task(robot.call("steer", pair="front", angle_deg=60.0))
    await robot.until(lambda: robot.app.devices.brakes["front"].state is BrakeState.RELEASED)
    await asyncio.sleep(0.3)
    return steering


def powered(robot: Robot) -> list[str]:
    return [name for name, drive in robot.network.drives.items() if drive.control.state.power_stage_on]


async def _forget(task: asyncio.Task[dict[str, object]]) -> None:
    task.cancel()
    await asyncio.wait([task])


async def test_a_robot_in_mid_drive_is_at_rest_and_off_in_the_time_of_its_ramp() -> None:
    async with running_robot(expect_errors=True) as robot:
        driving = await _drive(robot)
        async with killed(robot) as master:
            begin_s = asyncio.get_running_loop().time()
            assert await secure(master, robot.app.profile) == 0
            took_s = asyncio.get_running_loop().time() - begin_s
        ramp_s = 0.5 / min(drive.quick_stop_m_s2 for drive in robot.app.profile.drives.values())
        assert took_s < ramp_s + 0.5
        assert robot.fastest_wheel_m_s < 0.01
        assert powered(robot) == []
        await _forget(driving)


async def test_a_drive_that_has_noticed_the_death_by_itself_is_left_off() -> None:
    async with running_robot(expect_errors=True) as robot:
        driving = await _drive(robot)
        async with killed(robot) as master:
            await asyncio.sleep(LIFE_TIME_S + 1.0)
            assert robot.fastest_wheel_m_s < 0.01
            assert await secure(master, robot.app.profile) == 0
        assert powered(robot) == []
        await _forget(driving)


async def test_the_brake_of_a_pair_that_was_being_turned_is_engaged_again() -> None:
    async with running_robot(expect_errors=True) as robot:
        steering = await _release_front_brake_by_steering(robot)
        async with killed(robot) as master:
            await asyncio.sleep(5.0)
            assert not robot.network.brakes["front"].engaged
            assert await secure(master, robot.app.profile) == 0
        assert robot.network.brakes["front"].engaged
        await _forget(steering)


async def test_after_an_orderly_end_nothing_is_switched(monkeypatch: pytest.MonkeyPatch) -> None:
    async with running_robot(expect_errors=True) as robot:
        assert robot.app.medium is not None
        async with killed(robot) as master:
            switched: list[int] = []
            for brake in robot.network.brakes.values():
                monkeypatch.setattr(brake, "set_coil", switched.append)
            assert await secure(master, robot.app.profile) == 0
        assert switched == []
        assert powered(robot) == []


async def test_a_drive_without_power_keeps_nobody_from_the_others(capsys: pytest.CaptureFixture[str]) -> None:
    async with running_robot(expect_errors=True) as robot:
        steering = await _release_front_brake_by_steering(robot)
        async with killed(robot) as master:
            robot.network.power_off("rear_left")
            assert await secure(master, robot.app.profile) == 0
        assert robot.network.brakes["front"].engaged
        said = capsys.readouterr().err
        assert "node 2 (rear_left) did not answer" in said
        assert "3 of 4 drives are stopped and off" in said
        await _forget(steering)


async def test_a_holding_brake_engages_at_rest_and_before_the_power_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    async with running_robot(robot_with_a_holding_brake(), expect_errors=True) as robot:
        await robot.call("motor.enable", node="rear_left")
        await robot.call("brake.release", pair="wheel")
        turning = asyncio.create_task(robot.call("motor.velocity", node="rear_left", velocity_rpm=300.0))
        await asyncio.sleep(1.0)
        drive, brake = robot.network.drives["rear_left"], robot.network.brakes["wheel"]
        seen: list[tuple[bool, bool]] = []
        monkeypatch.setattr(brake, "_act", lambda engaged: seen.append((engaged, drive.control.state.power_stage_on)))
        async with killed(robot) as master:
            assert await secure(master, robot.app.profile) == 0
        assert seen == [(True, True)]
        assert powered(robot) == []
        await _forget(turning)


def robot_with_a_holding_brake() -> Profile:
    profile = load("max2d").profile
    held = BrakeConfig(kind="holding", drive="rear_left", open_time_s=0.03, close_time_s=0.02)
    return msgspec.structs.replace(profile, brakes={**profile.brakes, "wheel": held})


async def test_a_drive_that_does_not_switch_off_is_told_of(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async with running_robot(expect_errors=True) as robot:
        driving = await _drive(robot)
        async with killed(robot) as master:
            await master.sdo(3).write(OBJECTS["life_time_factor"], 0)
            monkeypatch.setattr(robot.network.drives["front_left"].control, "command", lambda word: None)
            assert await secure(master, robot.app.profile) == 1
        assert "node 3 (front_left) does not switch off" in capsys.readouterr().err
        await _forget(driving)


def test_a_simulated_network_has_gone_with_its_daemon(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["make-safe", "--profile", "max2d", "--bus", "simulated"]) == 0
    assert "gone with its daemon" in capsys.readouterr().err


def test_a_bus_that_is_missing_is_no_failure(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async def refuse(_: PythonCanBus) -> None:
        raise BusOff("the adapter is missing", remedy="plug it in")

    monkeypatch.setattr(PythonCanBus, "open", refuse)
    assert main(["make-safe", "--profile", "max2d", "--bus", "slcan:/dev/ttyNONE"]) == 0
    assert "no drive can be reached: the adapter is missing" in capsys.readouterr().err


def test_the_profile_that_the_daemon_had_goes_before_its_file(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    async def refuse(_: PythonCanBus) -> None:
        raise BusOff("the adapter is missing", remedy="plug it in")

    monkeypatch.setattr(PythonCanBus, "open", refuse)
    spoilt = tmp_path / "spoilt.yaml"
    spoilt.write_text("schema_version: 1\n")
    command = ["make-safe", "--profile", str(spoilt), "--bus", "slcan:/dev/ttyNONE"]
    assert main(command) == ConfigError.exit_code
    monkeypatch.setenv("RUNTIME_DIRECTORY", str(tmp_path))
    keep(load("max2d").profile, tmp_path)
    assert main(command) == 0
    assert "no drive can be reached" in capsys.readouterr().err
