"""Each part of the benchmark measures something, be it for a moment only."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks import campaigns, jitter, latency, nodes, process, rates, serial, simulation
from benchmarks.__main__ import RESULTS, main
from benchmarks.robots import STANDING
from benchmarks.section import Options, Section


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
    assert section.figures["loads"]["100"]["late"] == 0
    assert cells(section)[0][0] == 100.0


def test_a_rate_at_which_nothing_boots_is_shown_as_such() -> None:
    assert rates.cost_row(5000.0, None) == (5000.0, *[None] * 6)


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
    figures = process.run(options).figures
    assert 0.0 < figures["asked_s"] <= figures["idle_s"]
    assert len(figures["memory_mib"]) == 4


@pytest.mark.real_time
def test_results_of_other_parts_stay(tmp_path: Path) -> None:
    (tmp_path / RESULTS).write_text(json.dumps({"nodes": {"node_us": 5.0}}))
    assert main(["jitter", "--seconds", "0.05", "--out", str(tmp_path)]) == 0
    results = json.loads((tmp_path / RESULTS).read_text())
    assert results["nodes"] == {"node_us": 5.0}
    assert results["jitter"]["measured"]["processors"] > 0


def test_a_part_that_does_not_exist_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["latencies", "--out", str(tmp_path)])
    assert "no such part: latencies" in capsys.readouterr().err
