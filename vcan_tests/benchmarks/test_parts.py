"""Each part of the benchmark measures something, be it for a moment only."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path

import pytest

from benchmarks import campaigns, jitter, latency, nodes, process, rates, serial, simulation
from benchmarks.__main__ import RESULTS, grid, main
from benchmarks.load import Load
from benchmarks.robots import STANDING
from benchmarks.section import Options, Section, Table
from daemon.cli.output import console


@pytest.fixture
def options(tmp_path: Path) -> Options:
    return Options(tmp_path, 0.25)


def cells(section: Section) -> list[list[object]]:
    """All rows of all tables."""
    return [list(row) for table in section.tables for row in table.rows]


def test_the_simulation_is_faster_than_nothing(options: Options, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulation, "SCENES", (STANDING,))
    (scene,) = simulation.run(options).figures["scenes"]
    assert scene["times_real_time"] > 0.0


def test_nodes_cost_time_and_bits(options: Options) -> None:
    section = nodes.run(options, (2, 4))
    two, four = section.figures["counts"].values()
    assert two["daemon_us"] > 0.0
    assert two["bits"] < four["bits"]
    assert all(picture.stat().st_size for picture in section.pictures)


def test_rates_tell_where_the_robot_does_not_boot(options: Options, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rates, "RATES_HZ", (100.0,))
    monkeypatch.setattr(rates, "REAL_RATES_HZ", ())
    monkeypatch.setattr(rates, "highest_kept", lambda _: 100)
    section = rates.run(options)
    assert section.figures["loads"]["100"]["late_cycles"] == 0
    assert cells(section)[0][0] == 100.0


def test_a_rate_at_which_nothing_boots_is_shown_as_such() -> None:
    assert rates.cost_row(5000.0, None) == (5000.0, "does not boot", *[None] * 5)


def test_a_rate_at_which_the_daemon_s_time_is_not_seen_says_why() -> None:
    crowded = Load(200, 0, 200, 0, 1100.0, 0.97, None, 0.3)
    assert rates.cost_row(850.0, crowded)[1:3] == ("not seen: readings come late", None)


def test_a_fast_serial_line_has_more_cycles(options: Options, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serial, "BAUD_RATES", (115200, 38400))
    fast, slow = serial.run(options).figures.values()
    assert fast["cycle_hz"] > slow["cycle_hz"]
    assert 0.0 < fast["line_share"] <= 1.0


def test_every_run_of_a_campaign_is_counted(options: Options, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaigns, "RUNS_A_SECOND", 16)
    figures = campaigns.run(options).figures
    assert figures["runs"] == 4
    assert all(speed > 0.0 for speed in figures["runs_a_second"].values())


@pytest.mark.real_time
def test_the_latency_of_each_cycle_is_taken(options: Options) -> None:
    section = latency.run(options)
    assert section.figures["simulated"]["count"] == sum(section.figures["simulated"]["histogram"]) > 0


@pytest.mark.real_time
def test_both_producers_tick(options: Options) -> None:
    section = jitter.run(options)
    assert [row[0] for row in cells(section)] == list(jitter.PRODUCERS)


@pytest.mark.real_time
def test_a_process_is_asked_before_it_is_ready(options: Options, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process, "TIMES", 1)
    monkeypatch.setenv("XDG_STATE_HOME", str(options.out))
    figures = process.run(options).figures
    assert 0.0 < figures["asked_s"] <= figures["idle_s"]
    assert len(figures["memory_mib"]) == 4
    assert list(options.out.iterdir()) == []  # no run among those of the person


@pytest.mark.real_time
def test_results_of_other_parts_stay(tmp_path: Path) -> None:
    (tmp_path / RESULTS).write_text(json.dumps({"nodes": {"node_us": 5.0}}))
    assert main(["jitter", "--seconds", "0.05", "--out", str(tmp_path)]) == 0
    results = json.loads((tmp_path / RESULTS).read_text())
    assert results["nodes"] == {"node_us": 5.0}
    assert results["jitter"]["measured"]["processors"] > 0


def test_units_in_brackets_are_shown(capsys: pytest.CaptureFixture[str]) -> None:
    console().print(grid(Table("times [ms]", ("of", "CPU [us]"), (("[b]", 1.0),))))
    shown = capsys.readouterr().out
    assert all(words in shown for words in ("times [ms]", "CPU [us]", "[b]"))


def test_ctrl_c_is_told_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(name: str, _: Options) -> Section:
        if name == "serial":
            raise KeyboardInterrupt
        return Section(name, (), {})

    monkeypatch.setattr("benchmarks.__main__.measure", interrupted)
    assert main(["nodes", "serial", "sdo", "--out", str(tmp_path)]) == 130
    assert capsys.readouterr().err == f"canhelm: interrupted; kept in {tmp_path / RESULTS}: 1 of 3 parts\n"


def test_a_file_in_the_place_of_the_folder_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").touch()
    assert main(["nodes", "--out", str(tmp_path / "file")]) == 2
    assert "is no folder and cannot be made one: File exists" in capsys.readouterr().err


def test_a_folder_that_nothing_can_be_written_into_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def read_only(dir: Path) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr("daemon.cli.pictures.TemporaryFile", read_only)
    assert main(["nodes", "--out", str(tmp_path)]) == 2
    assert f"nothing can be written into --out {tmp_path}: Read-only file system" in capsys.readouterr().err


def test_a_part_that_does_not_exist_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["latencies", "--out", str(tmp_path)])
    assert "no such part: latencies" in capsys.readouterr().err
