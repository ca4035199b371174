"""A fault's cycles through the loops again."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest

from canhelm.errors import CanhelmError, ConfigError, UsageError
from daemon.cli.main import main
from daemon.recompute import recompute
from daemon.runs.store import FAULT, PROFILE, RECORDS, RunStore, read_runs
from daemon.runtime.clock import run_virtual
from profiles.loader import load
from vcan_tests.robot import running_robot

ASKED = {"angle_deg": 10.0, "speed_m_s": 0.5, "duration_s": 2.0}


def recorded(folder: Path) -> Path:
    """The run of an emergency stop in the second of two drives."""

    async def drive() -> None:
        async with running_robot(runs=RunStore(folder), expect_errors=True) as robot:
            await robot.call("drive.parallel", **ASKED)
            driving = asyncio.create_task(robot.call("drive.parallel", **ASKED))
            await robot.until(lambda: robot.speed_m_s > 0.2)
            robot.app.supervisor.estop("pressed by the test")
            with pytest.raises(CanhelmError):
                await driving

    run_virtual(drive())
    return next(run.folder for run in read_runs([folder]) if run.facts["kind"] == FAULT)


@pytest.fixture(scope="module")
def fault(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("runs"))


def lines_of(fault: Path) -> list[bytes]:
    return (fault / RECORDS).read_bytes().splitlines()


async def test_unchanged_loops_command_what_was_commanded(fault: Path) -> None:
    found = await recompute(load("max2d").profile, lines_of(fault))
    assert (found.difference, found.left_out) == (None, {})
    assert found.cycles > 300


async def test_a_stop_on_the_way_is_computed_as_well(tmp_path: Path) -> None:
    async with running_robot(runs=RunStore(tmp_path), expect_errors=True) as robot:
        driving = asyncio.create_task(
            robot.call("drive.turn", rear_deg=-10.0, front_deg=10.0, speed_m_s=0.5, duration_s=9.0)
        )
        await robot.until(lambda: robot.speed_m_s > 0.3)
        await robot.call("motion.stop", motion="1")
        with pytest.raises(CanhelmError):
            await driving
        robot.app.supervisor.estop("pressed by the test")
        await asyncio.sleep(0.1)
    fault = next(run.folder for run in read_runs([tmp_path]) if run.facts["kind"] == FAULT)
    found = await recompute(load("max2d").profile, lines_of(fault))
    assert (found.difference, found.left_out, found.cycles > 100) == (None, {}, True)


async def test_a_stream_is_left_out(tmp_path: Path) -> None:
    async with running_robot(runs=RunStore(tmp_path), expect_errors=True) as robot:
        await robot.call("drive.set", speed_m_s=0.1, valid_for_ms=1000)
        await asyncio.sleep(0.5)
        robot.app.supervisor.estop("pressed by the test")
        await asyncio.sleep(0.1)
    fault = next(run.folder for run in read_runs([tmp_path]) if run.facts["kind"] == FAULT)
    found = await recompute(load("max2d").profile, lines_of(fault))
    assert (found.cycles, list(found.left_out)) == (0, ["drive.set"])


async def test_a_robot_whose_laws_heed_more_than_the_records_hold_is_refused() -> None:
    with pytest.raises(UsageError, match="cannot be computed again"):
        await recompute(load("turtle").profile, [])


async def test_the_first_command_that_was_another_one_is_shown(fault: Path) -> None:
    lines = lines_of(fault)
    chosen = next(number for number, line in enumerate(lines) if b'"phase":"driving"' in line) + 50
    record: dict[str, Any] = json.loads(lines[chosen])
    record["command"]["wheel_speed_m_s"][1] += 0.01
    lines[chosen] = json.dumps(record).encode()
    difference = (await recompute(load("max2d").profile, lines)).difference
    assert difference is not None
    assert (difference["time_s"], difference["drives"]) == (record["time_s"], ["rear_left"])


async def test_a_motion_that_began_before_the_recording_is_left_out(fault: Path) -> None:
    lines = [line for line in lines_of(fault) if b'"begins"' not in line]
    found = await recompute(load("max2d").profile, lines)
    assert (found.cycles, found.left_out["drive.parallel"] > 300) == (0, True)


async def test_a_line_that_is_no_record_is_named(fault: Path) -> None:
    with pytest.raises(ConfigError, match="line 2 is no record of robot max2d"):
        await recompute(load("max2d").profile, [lines_of(fault)[0], b"nonsense"])


def test_the_command_takes_the_profile_beside_the_records(fault: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(fault / RECORDS), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["difference"] is None


def test_the_command_tells_which_motions_are_left_out(
    fault: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = tmp_path / "cut.jsonl"
    cut.write_bytes(b"\n".join(line for line in lines_of(fault) if b'"begins"' not in line))
    assert main(["replay", str(cut), "--profile", "max2d", "--json"]) == 0
    told = capsys.readouterr()
    answer = json.loads(told.out)
    assert answer["left_out_of"] == {"drive.parallel": answer["left_out"]}
    assert f"left out: {answer['left_out']} of drive.parallel; only steer" in told.err


def test_people_see_no_field_of_a_difference_where_there_is_none(
    fault: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert main(["replay", str(fault / RECORDS)]) == 0
    assert "difference" not in capsys.readouterr().out


def test_another_profile_shows_where_it_would_have_been_driven_otherwise(
    fault: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    slower = tmp_path / "slower.yaml"
    slower.write_text("schema_version: 1\nname: max2d\nextends: robots/max2d\nlimits: {acceleration_m_s2: 0.1}\n")
    assert main(["replay", str(fault / RECORDS), "--profile", str(slower), "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["difference"]["motions"] == ["drive.parallel"]


def test_records_that_are_not_there_are_wrong_usage(tmp_path: Path, fault: Path) -> None:
    (tmp_path / PROFILE).write_bytes((fault / PROFILE).read_bytes())
    assert main(["replay", str(tmp_path / RECORDS)]) == 2


def test_records_are_known_by_their_content_under_any_name(
    fault: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = tmp_path / "cut.jsonl"
    copy.write_bytes((fault / RECORDS).read_bytes())
    assert main(["replay", str(copy), "--profile", "max2d", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["difference"] is None


def test_records_without_a_profile_beside_them_are_told_of_the_option(
    fault: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / RECORDS).write_bytes((fault / RECORDS).read_bytes())
    assert main(["replay", str(tmp_path / RECORDS)]) == 2
    assert "--profile" in capsys.readouterr().err
