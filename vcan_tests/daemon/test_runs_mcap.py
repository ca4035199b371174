"""A run as an MCAP file, read again by the library's own reader."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from canhelm.errors import ConfigError, UsageError
from daemon.cli.main import main
from daemon.runs.mcap_file import schema_of, write_mcap
from daemon.runs.store import CYCLES, EVENTS, FACTS, FAULT, FRAMES, RECORDS, TERMS, Run, RunStore, read_runs, read_yaml
from vcan_tests.robot import running_robot


async def driven(folder: Path, *, fault: bool = False) -> Run:
    """The run of a short motion, or of the fault that ended it."""
    async with running_robot(runs=RunStore(folder), expect_errors=fault) as robot:
        driving = robot.begin("drive.parallel", angle_deg=0.0, speed_m_s=0.2, duration_s=0.5)
        if fault:
            await robot.until(lambda: robot.speed_m_s > 0.1)
            await robot.call("simulation.fault", kind="emcy", part="front_left", code=0x4210)
        await driving
    (run,) = [run for run in read_runs([folder]) if (run.facts["kind"] == FAULT) is fault]
    return run


def read(path: Path) -> dict[str, list[tuple[float, Any]]]:
    """Times [s] and contents of each channel."""
    channels: dict[str, list[tuple[float, Any]]] = {}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            channels.setdefault(channel.topic, []).append((message.log_time * 1e-9, json.loads(message.data)))
    return channels


def lines(run: Run, name: str) -> int:
    return (run.folder / name).read_text().count("\n")


async def test_a_motion_becomes_cycles_terms_and_frames_with_nothing_left_out(tmp_path: Path) -> None:
    run = await driven(tmp_path / "runs")
    counts = write_mcap(run, tmp_path / "run.mcap")
    channels = read(tmp_path / "run.mcap")
    assert counts == {topic: len(messages) for topic, messages in channels.items()}
    assert counts == {
        "/cycles": lines(run, CYCLES) - 1,
        "/terms": lines(run, TERMS),
        "/frames": lines(run, FRAMES),
    }


async def test_cycles_and_frames_of_a_run_have_the_times_at_which_they_were(tmp_path: Path) -> None:
    run = await driven(tmp_path / "runs")
    write_mcap(run, tmp_path / "run.mcap")
    channels = read(tmp_path / "run.mcap")
    begun_s, end_s = run.facts["begun_unix_s"], run.facts["begun_unix_s"] + run.facts["duration_s"]
    for messages in channels.values():
        assert all(begun_s - 0.05 <= time_s <= end_s + 0.05 for time_s, _ in messages)
    last = channels["/cycles"][-1][1]
    assert last["x_m"] == pytest.approx(0.1, abs=0.02)
    assert set(last["front_left"]) == {"commanded_m_s", "speed_m_s", "travel_m", "current_a"}


async def test_a_fault_becomes_records_and_events_at_the_time_of_day(tmp_path: Path) -> None:
    run = await driven(tmp_path / "runs", fault=True)
    counts = write_mcap(run, tmp_path / "fault.mcap")
    channels = read(tmp_path / "fault.mcap")
    assert (counts["/records"], counts["/events"]) == (lines(run, RECORDS), lines(run, EVENTS))
    assert "over-temperature" in channels["/events"][-1][1]["message"]
    assert channels["/events"][-1][0] == pytest.approx(channels["/cycles"][-1][0], abs=0.05)
    assert channels["/frames"][-1][0] == pytest.approx(channels["/cycles"][-1][0], abs=0.05)


async def test_facts_and_profile_are_attached(tmp_path: Path) -> None:
    run = await driven(tmp_path / "runs")
    write_mcap(run, tmp_path / "run.mcap")
    with (tmp_path / "run.mcap").open("rb") as file:
        attached = {one.name: one.data for one in make_reader(file).iter_attachments()}
    assert attached[FACTS] == (run.folder / FACTS).read_bytes()
    assert set(attached) == {FACTS, "profile.yaml", "drives.yaml"}


async def test_lines_that_were_cut_short_are_left_out(tmp_path: Path) -> None:
    run = await driven(tmp_path / "runs")
    whole = write_mcap(run, tmp_path / "whole.mcap")
    for name in (TERMS, FRAMES):
        data = (run.folder / name).read_bytes()
        (run.folder / name).write_bytes(data[: len(data) - 5])
    cut = write_mcap(run, tmp_path / "cut.mcap")
    assert {topic: whole[topic] - cut[topic] for topic in whole} == {"/cycles": 0, "/terms": 1, "/frames": 1}


async def test_a_file_that_is_there_is_not_overwritten(tmp_path: Path) -> None:
    run = await driven(tmp_path / "runs")
    (tmp_path / "run.mcap").write_text("mine")
    with pytest.raises(UsageError, match="is there already"):
        write_mcap(run, tmp_path / "run.mcap")
    assert (tmp_path / "run.mcap").read_text() == "mine"


async def test_a_run_without_its_facts_is_refused(tmp_path: Path) -> None:
    run = await driven(tmp_path / "runs")
    with pytest.raises(ConfigError, match="does not tell when"):
        write_mcap(Run(run.number, run.folder, {}), tmp_path / "run.mcap")
    assert not (tmp_path / "run.mcap").exists()


def test_without_the_library_the_message_has_the_line_that_installs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("daemon.runs.mcap_file.find_spec", lambda _: None)
    with pytest.raises(UsageError) as caught:
        write_mcap(Run(1, tmp_path, {}), tmp_path / "run.mcap")
    assert caught.value.remedy == "pip install 'canhelm[mcap]'"


def test_a_schema_tells_the_types_of_what_it_was_made_of() -> None:
    value = {"a": 1.5, "b": "x", "c": True, "d": [1], "e": None, "f": []}
    assert schema_of(value)["properties"] == {
        "a": {"type": "number"},
        "b": {"type": "string"},
        "c": {"type": "boolean"},
        "d": {"type": "array", "items": {"type": "number"}},
        "e": {},
        "f": {"type": "array"},
    }


async def test_the_command_writes_the_file_and_tells_what_is_in_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = await driven(tmp_path / "runs")
    file = tmp_path / "run.mcap"
    assert main(["runs", "export", "1", "--mcap", str(file), "--runs", str(tmp_path / "runs")]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["messages"]["/cycles"] == read_yaml(run.folder / FACTS)["rows"] == len(read(file)["/cycles"])


def exported(log: Path) -> int:
    return main(["runs", "export", str(log), "--mcap", str(log.with_suffix(".mcap"))])


def test_a_log_of_the_bus_becomes_a_file_with_its_frames(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "candump-max2d-1.log"
    log.write_text("(1700000000.250000) can0 080#\n(1700000000.251000) can0 181#3706\n(1700000000.25")
    assert exported(log) == 0
    assert json.loads(capsys.readouterr().out)["messages"] == {"/frames": 2}
    sync, status = read(log.with_suffix(".mcap"))["/frames"]
    assert sync[0] == pytest.approx(1_700_000_000.25, abs=1e-5)
    assert status[1] == {"interface": "can0", "id": 0x181, "id_hex": "181", "remote": False, "data_hex": "3706"}


@pytest.mark.parametrize(("content", "code"), [(None, 2), ("no frame\n", 2)])
def test_a_log_that_holds_nothing_leaves_no_file(tmp_path: Path, content: str | None, code: int) -> None:
    log = tmp_path / "bus.log"
    if content is not None:
        log.write_text(content)
    assert exported(log) == code
    assert not log.with_suffix(".mcap").exists()
