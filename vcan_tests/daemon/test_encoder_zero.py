"""``encoder.zero``: heading 0 is where the pair stands, kept in the device or in the profile."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from canhelm.errors import DeviceFault, Interlock, NodeAbsent
from daemon.cli.main import main
from drivers.simulated.max2d import Max2dWorld
from profiles.loader import load
from vcan_tests.daemon.fake_backend import FakeBackend, served
from vcan_tests.robot import Robot, running_robot


def place(robot: Robot, heading_deg: float) -> None:
    """Put the front pair somewhere, by hand."""
    assert isinstance(robot.network.world, Max2dWorld)
    robot.network.world.set_heading("front", math.radians(heading_deg))


def heading_deg(robot: Robot) -> float:
    return math.degrees(robot.app.devices.encoders["front"].heading_rad)


async def test_the_device_keeps_its_zero_over_a_power_off() -> None:
    async with running_robot(expect_errors=True) as robot:
        place(robot, 10.0)
        told = await robot.call("encoder.zero", pair="front", store="device", force=False)
        assert told["position_before_counts"] == 2048 + round(10.0 / 360.0 * 4096)
        assert abs(told["position_counts"] - 2048) <= 1
        robot.network.power_off("front")
        await asyncio.sleep(0.5)
        robot.network.power_on("front")
        await robot.until(lambda: robot.state == "idle")
        await asyncio.sleep(0.1)
        assert heading_deg(robot) == pytest.approx(0.0, abs=0.1)


async def test_a_zero_for_the_profile_leaves_the_device_alone() -> None:
    async with running_robot() as robot:
        place(robot, 10.0)
        told = await robot.call("encoder.zero", pair="front", store="profile", force=False)
        assert (told["zero_before_counts"], told["zero_counts"]) == (2048, 2048 + round(10.0 / 360.0 * 4096))
        assert (await robot.call("encoder.status", pair="front"))["encoders"][0]["offset_counts"] == 0


async def test_a_pair_far_from_its_old_zero_is_zeroed_by_force_alone() -> None:
    async with running_robot() as robot:
        place(robot, 60.0)
        await asyncio.sleep(0.1)
        with pytest.raises(Interlock, match=r"stands at 60\.\d degrees by its old zero, with its brake engaged"):
            await robot.call("encoder.zero", pair="front", store="profile", force=False)
        told = await robot.call("encoder.zero", pair="front", store="profile", force=True)
        assert told["heading_before_deg"] == pytest.approx(60.0, abs=0.2)


async def test_a_pair_that_moves_is_not_zeroed() -> None:
    async with running_robot() as robot:
        asyncio.get_running_loop().call_later(0.1, lambda: place(robot, 3.0))
        with pytest.raises(Interlock, match="the front pair moves"):
            await robot.call("encoder.zero", pair="front", store="device", force=False)


async def test_nothing_is_zeroed_while_a_drive_is_enabled() -> None:
    async with running_robot() as robot:
        await robot.call("motor.enable", node="rear_left")
        with pytest.raises(Interlock, match="a drive is enabled"):
            await robot.call("encoder.zero", pair="front", store="device", force=False)


async def test_an_encoder_that_forgets_its_zero_is_found_out() -> None:
    async with running_robot(expect_errors=True) as robot:
        place(robot, 10.0)
        memory = robot.network.encoders["front"].dictionary
        memory.actions[memory.address("save_all_parameters")] = lambda _: None
        with pytest.raises(DeviceFault, match="has forgotten its zero"):
            await robot.call("encoder.zero", pair="front", store="device", force=False)


async def test_an_unknown_pair_is_told_with_those_that_there_are() -> None:
    async with running_robot() as robot:
        with pytest.raises(NodeAbsent) as refused:
            await robot.call("encoder.status", pair="middle")
        assert refused.value.remedy == "encoders: rear, front"


# --- the command -----------------------------------------------------------------------------------------------------


class Backend(FakeBackend):
    """A daemon whose encoder is zeroed."""

    file: Path

    def status(self) -> dict[str, Any]:
        nodes = [(name, drive.node) for name, drive in load(self.file).profile.drives.items()]
        nodes += [(name, encoder.node) for name, encoder in load(self.file).profile.encoders.items()]
        told = [{"name": name, "node": node, "node_state": "ready", "status": ""} for name, node in nodes]
        return {"robot": "lab1", "state": "idle", "profile_file": str(self.file), "nodes": told}

    async def call(self, method: str, params: dict[str, Any], lease: str | None) -> dict[str, Any]:
        counts = {"position_before_counts": 2160, "zero_before_counts": 2048}
        return {"pair": "front", **counts, "zero_counts": 2160 if params["store"] == "profile" else 2048}


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    file = tmp_path / "lab1.yaml"
    file.write_text("schema_version: 1\nextends: max2d\n")
    backend = Backend()
    backend.file = file
    monkeypatch.setenv("CANHELM_SOCKET", str(tmp_path / "lab1.sock"))
    with served(backend, tmp_path / "lab1.sock"):
        yield file


@pytest.mark.real_time
@pytest.mark.parametrize(("store", "zero", "before"), [("device", 2048, 2160), ("profile", 2160, 2048)])
def test_the_old_value_is_kept_in_the_side_file(store: str, zero: int, before: int, file: Path) -> None:
    assert main(["encoder", "zero", "front", "--store", store, "--yes", "--json"]) == 0
    encoder = load(file).profile.encoders["front"]
    assert (encoder.zero_counts, encoder.zero_before_counts) == (zero, before)
