"""A vehicle kind from outside the tree: the example's robot on mecanum wheels, against its own twin."""

from __future__ import annotations

import asyncio
import logging
import math
from pathlib import Path

import msgspec
import pytest

from canhelm.errors import ConfigError, DeviceFault, LimitExceeded, Refused
from daemon.app import App
from profiles.loader import load
from profiles.own_vehicle import OwnGeometry
from profiles.schema import Profile
from vcan_tests.robot import Robot, running_robot

EXAMPLE = Path(__file__).parents[2] / "examples" / "own_vehicle"
FAULTY = """
from mecanum import Mecanum
from mecanum_twin import MecanumWorld

class Short(Mecanum):
    def step(self, measurement, target, dt_s):
        command = super().step(measurement, target, dt_s)
        return type(command)(command.wheel_speed_m_s[:3])

class Boom(Mecanum):
    def step(self, measurement, target, dt_s):
        raise KeyError("boom")

class Weightless(MecanumWorld):
    def __init__(self, profile, seed):
        super().__init__(profile, seed)
        self.weight_n = profile.vehicle.parameters["mass"] * 9.81

class Lost(Mecanum):
    def body_motion(self, rolled, heading_rad):
        if any(rolled):
            raise ZeroDivisionError("no idea where this is")
        return super().body_motion(rolled, heading_rad)
"""


@pytest.fixture
def mecanum(monkeypatch: pytest.MonkeyPatch) -> Profile:
    """The example's robot."""
    monkeypatch.syspath_prepend(EXAMPLE)
    return load(EXAMPLE / "mecanum.yaml").profile


@pytest.fixture
def faulty(mecanum: Profile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Profile:
    """The same with a law that has a defect; which, its test says."""
    (tmp_path / "faulty.py").write_text(FAULTY)
    monkeypatch.syspath_prepend(tmp_path)
    return mecanum


def changed(profile: Profile, **vehicle: str | None) -> Profile:
    """The robot with something else in its vehicle."""
    assert isinstance(profile.vehicle, OwnGeometry)
    return msgspec.structs.replace(profile, vehicle=msgspec.structs.replace(profile.vehicle, **vehicle))


def near(robot: Robot, x_m: float, y_m: float, yaw_deg: float) -> None:
    """The true pose, and what the robot takes for it."""
    x, y, yaw = robot.network.world.pose
    assert (x, y, math.degrees(yaw)) == pytest.approx((x_m, y_m, yaw_deg), abs=0.02)
    odometry = robot.app.service.status()["vehicle"]["odometry"]
    assert (odometry["x_m"], odometry["y_m"]) == pytest.approx((x, y), abs=0.002)
    assert odometry["yaw_deg"] == pytest.approx(math.degrees(yaw), abs=0.2)


async def test_it_drives_a_square_without_turning(mecanum: Profile) -> None:
    async with running_robot(mecanum) as robot:
        for angle_deg, x_m, y_m in ((0, 0.5, 0), (90, 0.5, 0.5), (180, 0, 0.5), (-90, 0, 0)):
            await robot.call("drive.parallel", angle_deg=angle_deg, speed_m_s=0.5, duration_s=1)
            near(robot, x_m, y_m, 0)


async def test_it_turns_on_the_spot(mecanum: Profile) -> None:
    async with running_robot(mecanum) as robot:
        result = await robot.call("drive.rotate", rate_deg_s=45, duration_s=2)
        assert result["heading_deg"] == pytest.approx(90, abs=0.5)
        assert robot.network.world.pose[:2] == pytest.approx((0, 0), abs=0.005)


async def test_it_follows_a_stream_on_a_circle_and_stops_when_values_stay_out(mecanum: Profile) -> None:
    async with running_robot(mecanum) as robot:
        for _ in range(200):
            await robot.call("drive.set", speed_m_s=0.3, yaw_rate_deg_s=60, valid_for_ms=100)
            await asyncio.sleep(0.01)
        assert robot.speed_m_s == pytest.approx(0.3, abs=0.01)
        silent_s = await robot.until(lambda: robot.fastest_wheel_m_s < 0.01)
        assert 0.3 < silent_s < 0.9
        await robot.until(lambda: robot.state == "idle")
        x, y, _ = robot.network.world.pose
        radius_m = 0.3 / math.radians(60)
        assert math.hypot(x, y - radius_m) == pytest.approx(radius_m, abs=0.01)


async def test_what_its_law_objects_to_is_refused_in_its_words(mecanum: Profile) -> None:
    async with running_robot(mecanum) as robot:
        with pytest.raises(Refused, match=r"a wheel would roll at 1\.\d+ m/s, it may 1\.2"):
            await robot.call("drive.set", direction_deg=45, speed_m_s=0.8, yaw_rate_deg_s=60, valid_for_ms=300)
        with pytest.raises(LimitExceeded, match=r"at most 0\.8 m/s"):
            await robot.call("drive.parallel", angle_deg=0, speed_m_s=0.9, duration_s=1)
        with pytest.raises(Refused, match="steering angle"):
            await robot.call("drive.set", steering_deg=5, speed_m_s=0.1, valid_for_ms=300)
        assert robot.speed_m_s == 0
        assert set(robot.app.vehicle.sticks()) == {"speed", "sideways", "yaw_rate"}


async def test_without_a_twin_its_wheels_turn_in_the_air(mecanum: Profile) -> None:
    bare = changed(mecanum, twin=None)
    async with running_robot(bare) as robot:
        result = await robot.call("drive.parallel", angle_deg=0, speed_m_s=0.5, duration_s=1)
        assert result["x_m"] == pytest.approx(0.5, abs=0.01)
        assert robot.network.world.pose == (0, 0, 0)


def test_a_twin_that_cannot_be_made_is_named(faulty: Profile) -> None:
    with pytest.raises(ConfigError, match="twin faulty:Weightless cannot be made: KeyError: 'mass'"):
        App(changed(faulty, twin="faulty:Weightless"))


async def test_the_log_says_whose_code_runs_inside_the_daemon(
    mecanum: Profile, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO, "canhelm"):
        async with running_robot(mecanum):
            pass
    told = f"mecanum:Mecanum of {EXAMPLE / 'mecanum.py'} runs inside this daemon, with all of its rights"
    assert any(record.getMessage() == told for record in caplog.records)


async def test_a_law_that_raises_is_named_with_its_line_and_its_owner_mends_it(faulty: Profile) -> None:
    told = r"step of faulty:Boom failed: KeyError: 'boom' \(.*faulty\.py:12\)"
    async with running_robot(changed(faulty, kind="faulty:Boom"), expect_errors=True) as robot:
        with pytest.raises(DeviceFault, match=told) as refused:
            await robot.call("drive.parallel", angle_deg=0, speed_m_s=0.5, duration_s=1)
        assert str(refused.value.remedy).startswith("mend the class")


async def test_a_law_that_commands_too_few_wheels_stops_the_vehicle(faulty: Profile) -> None:
    async with running_robot(changed(faulty, kind="faulty:Short"), expect_errors=True) as robot:
        with pytest.raises(DeviceFault):
            await robot.call("drive.parallel", angle_deg=0, speed_m_s=0.5, duration_s=1)
        assert robot.state == "fault"
        assert "3 wheel speeds for 4 wheels" in robot.app.service.status()["message"]


async def test_a_law_whose_odometry_fails_on_the_way_stops_the_vehicle_and_is_asked_no_more(faulty: Profile) -> None:
    async with running_robot(changed(faulty, kind="faulty:Lost"), expect_errors=True) as robot:
        with pytest.raises(DeviceFault):
            await robot.call("drive.parallel", angle_deg=0, speed_m_s=0.5, duration_s=1)
        assert "no idea where this is" in robot.app.service.status()["vehicle"]["failure"]
        await robot.until(lambda: robot.fastest_wheel_m_s < 0.01)
        await robot.call("reset")
        with pytest.raises(DeviceFault, match="no idea"):
            await robot.call("drive.parallel", angle_deg=0, speed_m_s=0.5, duration_s=1)
