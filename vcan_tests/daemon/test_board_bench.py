"""The bench of the user's own board: which rate is safe, and why a faster one is not."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest

from canhelm.errors import Refused
from daemon import board_bench
from daemon.board_bench import bench
from daemon.cli import bench as command
from daemon.cli.main import main
from daemon.loops.paired_steer import PairedSteerLaw
from daemon.runtime.clock import VirtualTimeLoop
from profiles.loader import load
from vcan_tests.daemon.fake_backend import FakeBackend, served


async def test_every_rate_that_the_wire_carries_is_safe_on_a_machine_that_is_never_late() -> None:
    told: list[str] = []
    result = await bench(load("max2d").profile, "simulated", 2.1, told.append)
    assert result["highest_safe_hz"] == board_bench.RATES_HZ[-1]
    assert len(told) == len(board_bench.RATES_HZ)


async def test_the_latency_is_that_of_the_wire(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(board_bench, "RATES_HZ", (100.0,))
    result = await bench(load("max2d").profile, "simulated", 1.0, lambda _: None)
    (rate,) = result["rates"]
    assert rate["cycles"] == pytest.approx(100, abs=1)
    assert 0.3 < rate["latency_ms"] < 1.5
    assert rate["worst_jitter_ms"] < 0.5


async def test_a_rate_at_which_the_robot_does_not_boot_ends_the_bench(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(board_bench, "RATES_HZ", (100.0, 4000.0, 50.0))
    monkeypatch.setattr(board_bench, "BOOT_DEADLINE_S", 2.0)
    told: list[str] = []
    result = await bench(load("max2d").profile, "simulated", 0.9, told.append)
    assert [rate["hz"] for rate in result["rates"]] == [100.0]
    assert "did not boot" in told[-1]


async def test_a_rate_at_which_cycles_are_late_is_not_safe_and_the_last_one(monkeypatch: pytest.MonkeyPatch) -> None:
    loop, step = asyncio.get_running_loop(), PairedSteerLaw.step
    assert isinstance(loop, VirtualTimeLoop)

    def slow(law: PairedSteerLaw, *arguments: Any) -> Any:
        """A law that takes 8 ms of processor time."""
        loop._now_s += 0.008
        return step(law, *arguments)

    monkeypatch.setattr(PairedSteerLaw, "step", slow)
    monkeypatch.setattr(board_bench, "RATES_HZ", (50.0, 150.0, 50.0))
    result = await bench(load("max2d").profile, "simulated", 0.9, lambda _: None)
    assert [rate["safe"] for rate in result["rates"]] == [True, False]
    assert result["highest_safe_hz"] == 50.0


@pytest.mark.real_time
def test_doctor_bench_measures_this_machine(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(board_bench, "RATES_HZ", (20.0,))
    main(["doctor", "--bench", "3", "--json"])
    (rate,) = json.loads(capsys.readouterr().out)["rates"]
    assert rate["cycles"] > 20


def test_a_bench_that_is_too_short_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--bench", "nan"]) == 2
    assert "too short" in capsys.readouterr().err


def test_a_bus_that_a_daemon_uses_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Busy(FakeBackend):
        def status(self) -> dict[str, Any]:
            return {**super().status(), "robot": "lab1", "bus": {"name": "can0"}}

    with served(Busy(), tmp_path / "lab1.sock") as server:
        monkeypatch.setattr("canhelm.protocol.find_sockets", lambda: [server.path])
        with pytest.raises(Refused, match="the daemon of lab1 uses can0"):
            command.measure(5.0, "socketcan:can0", "max2d")
