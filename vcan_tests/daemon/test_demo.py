"""The demo: published figures within tolerances, the same bytes for the same seed, logs that others can read."""

from __future__ import annotations

import math
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import can
import msgspec
import pytest

from canhelm.errors import UsageError
from daemon.cli.main import main
from daemon.demo import FIGURES, Demo, FigureResult
from daemon.runtime.clock import run_virtual
from profiles.loader import load
from vcan_tests.log_reader import LogReader


def drive(seed: int, record: Path | None, *identities: str, bus: str = "simulated") -> list[FigureResult]:
    async def run() -> list[FigureResult]:
        figures = tuple(figure for figure in FIGURES if not identities or figure.identity in identities)
        return await Demo(load("max2d").profile, seed, record, lambda _: None, bus=bus).run(figures)

    return run_virtual(run())


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, dict[str, Any]], Path]:
    folder = tmp_path_factory.mktemp("demo")
    results = drive(7, folder)
    return {result.figure.identity: result.numbers for result in results}, next(folder.glob("*.log"))


@pytest.mark.parametrize("identity", ["4.6", "4.7"])
def test_parallel_movement_ends_within_two_percent(recorded: Any, identity: str) -> None:
    commanded, achieved = recorded[0][identity]["commanded"], recorded[0][identity]["achieved"]
    error = math.hypot(achieved["end_x_m"] - commanded["end_x_m"], achieved["end_y_m"] - commanded["end_y_m"])
    assert error <= 0.02 * abs(commanded["speed_m_s"]) * commanded["duration_s"]


@pytest.mark.parametrize(("identity", "tolerance"), [("4.15", 0.10), ("4.16", 0.05)])
def test_the_driven_radius_is_near_the_commanded_one(recorded: Any, identity: str, tolerance: float) -> None:
    commanded, achieved = recorded[0][identity]["commanded"], recorded[0][identity]["achieved"]
    assert achieved["radius_m"] == pytest.approx(commanded["radius_m"], rel=tolerance)


@pytest.mark.parametrize("identity", ["4.6", "4.7", "4.15", "4.16"])
def test_pairs_are_steered_to_a_fifth_of_a_degree_and_no_cycle_is_late(recorded: Any, identity: str) -> None:
    numbers = recorded[0][identity]
    assert numbers["achieved"]["steering_error_deg"] <= 0.2
    assert numbers["late_cycles"] == 0


def test_one_seed_writes_the_same_bytes_twice(tmp_path: Path) -> None:
    drive(3, tmp_path / "a.log", "4.15")
    drive(3, tmp_path / "b.log", "4.15")
    assert (tmp_path / "a.log").read_bytes() == (tmp_path / "b.log").read_bytes()


def test_another_seed_writes_other_bytes(tmp_path: Path) -> None:
    drive(3, tmp_path / "a.log", "4.15")
    drive(4, tmp_path / "b.log", "4.15")
    assert (tmp_path / "a.log").read_bytes() != (tmp_path / "b.log").read_bytes()


def test_an_independent_decoder_accounts_for_every_frame_of_the_log(recorded: Any) -> None:
    """python-can reads the log; canopen decodes it, with mappings that it learns from the SDO frames in the log."""
    numbers, path = recorded
    reader = LogReader()
    with can.CanutilsLogReader(path) as log:
        for message in log:
            reader.take(message)
    assert reader.unaccounted == []
    assert reader.frames == len(path.read_text().splitlines())
    driven = sum(entry["frames"] for entry in numbers.values())
    assert 0 < reader.frames - driven < 3000
    assert reader.tpdo_values(3)["statusword"] & 0x417F == 0x0140
    assert reader.largest_target_rpm > 1000


def test_the_wheels_roll_in_the_log_as_they_did_in_the_simulation(recorded: Any) -> None:
    """Figure 4.6 by the log alone: the positions that canopen decodes make -4 m of way."""
    _, path = recorded
    reader = LogReader()
    with can.CanutilsLogReader(path) as log:
        for message in log:
            if message.timestamp > 6.0:
                break
            reader.take(message)
    qc_per_m = 2000 * 28 / (math.tau * 0.10)
    start, end = reader.positions_qc[3][0], reader.positions_qc[3][-1]
    assert (end - start) / qc_per_m == pytest.approx(-4.0, abs=0.04)


def test_over_a_serial_line_the_figures_are_driven_at_the_speed_that_its_rate_permits() -> None:
    parallel, turn = (result.numbers for result in drive(1, None, "4.7", "4.16", bus="rs232"))
    assert max(numbers["achieved"]["steering_error_deg"] for numbers in (parallel, turn)) <= 1.0
    assert (parallel["achieved"]["end_x_m"], parallel["achieved"]["end_y_m"]) == pytest.approx((1.0, 1.732), abs=0.06)
    assert turn["achieved"]["radius_m"] == pytest.approx(turn["commanded"]["radius_m"], rel=0.08)
    assert 0.8 < turn["commanded"]["speed_m_s"] < 1.0
    assert turn["line"]["cycle_hz"] > turn["line"]["planned_hz"]
    assert turn["line"]["own_idle_share"] <= 0.15


async def test_the_demo_refuses_a_robot_that_it_cannot_drive() -> None:
    bare = msgspec.structs.replace(load("max2d").profile, vehicle=None)
    with pytest.raises(UsageError, match="paired steering"):
        Demo(bare, 0, None, lambda _: None)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_a_signal_ends_the_demo_in_order_even_where_a_shell_has_ctrl_c_ignored(number: signal.Signals) -> None:
    command = [sys.executable, "-m", "daemon", "demo"]
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        running = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    finally:
        signal.signal(signal.SIGINT, before)
    assert running.stderr is not None
    assert "booting" in running.stderr.readline()
    running.send_signal(number)
    _, said = running.communicate(timeout=20)
    assert (running.returncode, said.splitlines()[-1]) == (130, "canhelm: interrupted")


def test_an_output_folder_that_cannot_be_is_wrong_usage(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    assert main(["demo", "--virtual-time", "--out", str(tmp_path / "file")]) == 2
    assert "is no folder and cannot be made one" in capsys.readouterr().err
