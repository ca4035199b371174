"""A candump log through the daemon's decoding."""

from __future__ import annotations

import io
import json
from pathlib import Path

import pytest
from rich.console import Console

from daemon.cli.main import main
from daemon.cli.replay import table
from daemon.replay import Replayed, replay
from daemon.runs.store import FRAMES, RunStore, read_runs
from daemon.runs.table import read_table
from daemon.runtime.clock import run_virtual
from drivers.bus.candump import LogFrame, make_line, parse_line
from profiles.loader import load
from vcan_tests.robot import running_robot


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The frames of a drive of 1 m."""
    folder = tmp_path_factory.mktemp("runs")

    async def drive() -> None:
        async with running_robot(runs=RunStore(folder)) as robot:
            await robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.5, duration_s=2.0)

    run_virtual(drive())
    return read_runs([folder])[0].folder / FRAMES


def frames(log: Path) -> list[LogFrame]:
    return [frame for line in log.read_text().splitlines() if (frame := parse_line(line))]


async def test_the_way_of_the_robot_is_found_again_in_the_frames(log: Path) -> None:
    rows = (await replay(load("max2d").profile, frames(log), 0.0)).rows
    assert rows[-1]["x_m"] - rows[0]["x_m"] == pytest.approx(1.0, abs=0.01)
    assert max(row["rear_left.speed_m_s"] for row in rows) == pytest.approx(0.5, abs=0.02)


async def test_currents_have_the_sign_of_the_run_and_push_forward_on_both_sides(log: Path) -> None:
    recorded = read_table(read_runs([log.parents[1]])[0]).numbers
    rows = (await replay(load("max2d").profile, frames(log), 0.0)).rows
    for name in ("rear_left", "rear_right"):
        column = f"{name}.current_a"
        assert max(row[column] for row in rows) == pytest.approx(max(recorded[column]), abs=0.1)
        assert max(recorded[column]) > 0.5


async def test_a_healthy_log_has_nothing_malformed(log: Path) -> None:
    replayed = await replay(load("max2d").profile, frames(log), 0.1)
    assert (replayed.frames, replayed.malformed) == (len(frames(log)), 0)
    assert 0 < replayed.read < replayed.frames


async def test_rows_are_no_closer_than_was_asked(log: Path) -> None:
    rows = (await replay(load("max2d").profile, frames(log), 0.5)).rows
    assert len(rows) == pytest.approx(6, abs=1)


async def test_an_emergency_is_told_with_its_time() -> None:
    log = [LogFrame(10.0, "can0", 0x080, b""), LogFrame(12.5, "can0", 0x082, bytes.fromhex("1023030000000000"))]
    (event,) = (await replay(load("max2d").profile, log, 0.1)).events
    assert (event["time_s"], "0x2310" in event["event"]) == (2.5, True)


async def test_a_telegram_of_wrong_length_is_counted() -> None:
    log = [LogFrame(0.0, "can0", 0x181, b"\x37")]
    assert (await replay(load("max2d").profile, log, 0.1)).malformed == 1


def test_the_command_writes_rows_and_reports_in_the_order_of_time(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    last = frames(log)[-1].timestamp_s
    copy = tmp_path / "copy.log"
    emergency = make_line(last, "vcan0", 0x082, bytes.fromhex("1023030000000000"))
    copy.write_text(f"{log.read_text()}{emergency}\nnonsense\n")
    assert main(["replay", str(copy), "--json"]) == 0
    output = capsys.readouterr()
    rows = [json.loads(line) for line in output.out.splitlines()]
    assert "0x2310" in rows[-1]["event"]
    assert "1 lines of copy.log" in output.err


def drawn(replayed: Replayed, width: int) -> list[str]:
    text = io.StringIO()
    Console(file=text, width=width).print(table([*replayed.rows, *replayed.events]))
    return text.getvalue().splitlines()


async def test_eighty_columns_show_every_wheel_with_its_unit(log: Path) -> None:
    lines = drawn(await replay(load("max2d").profile, frames(log), 0.5), 80)
    heads = [[line[max(0, end - 6) : end].strip() for line in lines[:3]] for end in column_ends(lines[2])]
    wheels = [[*name.split("_"), "m/s"] for name in ("rear_right", "rear_left", "front_left", "front_right")]
    pose = [["", "time", "s"], ["", "x", "m"], ["", "y", "m"], ["", "yaw", "°"]]
    assert heads == [*pose, *wheels, ["", "rear", "°"], ["", "front", "°"]]


def column_ends(units: str) -> list[int]:
    """Where the columns of a line of units end, which stand at the right."""
    return [end for end in range(1, len(units) + 1) if units[end - 1] != " " and units[end : end + 1] in ("", " ")]


async def test_what_was_reported_stands_below_on_one_line() -> None:
    log = [LogFrame(10.0, "can0", 0x080, b""), LogFrame(12.5, "can0", 0x082, bytes.fromhex("1023030000000000"))]
    replayed = await replay(load("max2d").profile, log, 0.1)
    assert drawn(replayed, 120)[-1].rstrip().split(maxsplit=1) == ["2.500", replayed.events[0]["event"]]


@pytest.mark.parametrize(
    ("content", "told"),
    [(b"\x89MCAP0\r\n\x01", "is MCAP, and candump logs alone"), (b"\x89PNG\r\n\x1a\n", "is no candump log")],
)
def test_a_file_of_another_kind_is_told_to_be_one(
    content: bytes, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_bytes(content)
    assert main(["replay", str(tmp_path / "file")]) == 2
    assert told in capsys.readouterr().err


@pytest.mark.parametrize(
    ("content", "options", "code"),
    [
        (None, [], 2),
        ("nonsense\n", [], 2),
        ("", ["--every", "-1"], 2),
        ("", ["--profile", "nobody"], 7),
        ("", ["--profile", "nxt"], 2),
    ],
)
def test_nonsense_is_refused(tmp_path: Path, content: str | None, options: list[str], code: int) -> None:
    file = tmp_path / "file.log"
    if content is not None:
        file.write_text(content)
    assert main(["replay", str(file), *options]) == code
