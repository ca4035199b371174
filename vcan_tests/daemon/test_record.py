"""Frames of a daemon's bus for a client that writes them down."""

from __future__ import annotations

import asyncio
import itertools
from pathlib import Path
from typing import Any

import pytest

from daemon.cli.main import main
from daemon.runtime import frame_commands
from daemon.runtime.frame_commands import UNASKED_S, FrameCommands
from drivers.bus.candump import parse_line
from drivers.simulated.bus import SimulatedBus
from vcan_tests.daemon.fake_backend import FakeBackend, served
from vcan_tests.robot import running_robot


async def test_answers_join_without_a_gap() -> None:
    async with running_robot() as robot:
        first = await robot.call("bus.frames")
        await asyncio.sleep(0.5)
        second = await robot.call("bus.frames", after=first["next"])
        lines = first["frames"] + second["frames"]
    syncs = [frame.timestamp_s for line in lines if (frame := parse_line(line)) and frame.can_id == 0x080]
    assert len(syncs) == pytest.approx(90, abs=2)
    assert all(b - a == pytest.approx(0.01, abs=1e-3) for a, b in itertools.pairwise(syncs))


async def test_frames_that_a_client_came_too_late_for_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frame_commands, "KEPT", 5)
    port = SimulatedBus().port("master")
    ask = FrameCommands(port).handlers["bus.frames"]
    first = await ask({}, None)
    for _ in range(8):
        port.send(0x181)
    answer = await ask({"after": first["next"]}, None)
    assert (len(answer["frames"]), answer["next"], answer["lost"]) == (5, 8, 3)


async def test_a_number_of_another_daemon_gives_what_there_is() -> None:
    ask = FrameCommands(SimulatedBus().port("master")).handlers["bus.frames"]
    assert await ask({"after": 10**9}, None) == {"frames": [], "next": 0, "lost": 0}


async def test_nobody_listens_when_nobody_asks() -> None:
    port = SimulatedBus().port("master")
    await FrameCommands(port).handlers["bus.frames"]({}, None)
    assert len(port.taps) == 1
    await asyncio.sleep(UNASKED_S + 0.1)
    assert port.taps == []


class Talking(FakeBackend):
    """A daemon on whose bus one frame goes by between two answers."""

    async def call(self, method: str, params: dict[str, Any], lease: str | None) -> dict[str, Any]:
        assert method == "bus.frames"
        await asyncio.sleep(0.05)
        number = params.get("after") or 0
        return {"frames": [f"(000000000{number}.000000) can0 080#"], "next": number + 1, "lost": 0}


def test_the_command_writes_a_log_without_doubles(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "bus.log"
    with served(Talking(), tmp_path / "lab1.sock") as server:
        assert main(["record", str(log), "--duration", "0.3", "--socket", str(server.path)]) == 0
    lines = log.read_text().splitlines()
    assert len(lines) >= 2
    assert len(set(lines)) == len(lines)
    assert f"{len(lines)} frames recorded" in capsys.readouterr().err


def test_a_log_that_is_there_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "bus.log").write_text("precious")
    with served(Talking(), tmp_path / "lab1.sock") as server:
        assert main(["record", str(tmp_path / "bus.log"), "--socket", str(server.path)]) == 2
    assert (tmp_path / "bus.log").read_text() == "precious"


def test_recording_without_a_daemon_says_so(tmp_path: Path) -> None:
    assert main(["record", str(tmp_path / "bus.log"), "--socket", str(tmp_path / "none.sock")]) == 3
