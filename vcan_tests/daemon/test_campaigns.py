"""Campaigns: what they drive, and that their results survive whatever ends them."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from canhelm.errors import ConfigError, UsageError
from daemon.campaigns import cases
from daemon.campaigns.cases import Case, State, bounds_cases, following, thesis_states, tuning_cases
from daemon.campaigns.following_runs import ideal_run, outcome
from daemon.campaigns.results import CSV, PARQUET, opened, write_parquet
from daemon.campaigns.tables import BOUNDS, bending_table, bounds_table
from daemon.campaigns.workers import drive_all, drive_batch
from daemon.cli.campaign import drive_missing
from daemon.cli.main import main

FEW = following("thesis", thesis_states(), "cascade", None)[:12]
KILLED = """
import multiprocessing, os, signal, sys
from pathlib import Path
from daemon.campaigns.results import opened
from daemon.campaigns.workers import drive_all
from vcan_tests.daemon.test_campaigns import FEW

if __name__ == "__main__":
    with opened(Path(sys.argv[1]), FEW) as results:
        for batch in drive_all(results.missing, 2):
            results.keep(batch)
            print(*(child.pid for child in multiprocessing.active_children()), flush=True)
            os.kill(os.getpid(), signal.SIGKILL)
"""


def rows(folder: Path) -> list[str]:
    return (folder / CSV).read_text(encoding="utf-8").splitlines()[1:]


def test_no_two_cases_of_a_campaign_are_alike() -> None:
    for planned in (bounds_cases(200, 2009, "ideal"), tuning_cases()):
        assert len(set(planned)) == len(planned)


def test_every_row_of_the_thesis_is_among_the_forty_states() -> None:
    assert {state for bound in BOUNDS for state in bound.states} <= set(thesis_states())
    assert len(BOUNDS) == 20


def test_the_thesis_law_gives_the_bound_printed_for_the_line_and_20_cm() -> None:
    table = bounds_table(dict(drive_batch(following("thesis", thesis_states(), "thesis", None))))
    row = next(row for row in table if row["path"] == "line" and row["test"] == "position ±0.2 m")
    ours, printed = row["thesis, ideal"], row["published"]
    assert ours["position_m"] == pytest.approx(printed["position_m"], abs=0.001)
    assert (round(ours["heading_deg"]), round(ours["bending_deg"])) == (printed["heading_deg"], printed["bending_deg"])


@pytest.mark.parametrize(("gain", "reached_m"), [(3.0, 0.37), (4.0, 0.32), (5.0, 0.30)])
def test_the_bending_angle_is_reached_after_the_way_that_the_thesis_gives(gain: float, reached_m: float) -> None:
    case = Case("c_p", "ideal", "thesis", "none", None, target_deg=50.0, bending_gain=gain)
    (row,) = bending_table(dict(drive_batch([case])))
    assert row["reached_m"] == pytest.approx(reached_m, abs=0.025)


def test_overshoot_is_the_largest_error_on_the_other_side() -> None:
    run = ideal_run(Case("c_v", "ideal", "thesis", "line", None, 0.5))
    assert outcome(run).overshoot_m == -min(run.position_m) > 0.01


def test_fewer_random_states_than_before_go_on_in_the_same_folder(tmp_path: Path) -> None:
    out = drive_batch(FEW[:1])[0][1]
    for count in (11, 10, 12):
        plan = bounds_cases(count, 2009, "ideal")
        with opened(tmp_path, plan) as results:
            results.keep([(case, out) for case in results.missing])
            assert results.in_order().keys() == set(plan)
            assert len(results.finished) == len(plan)
    assert len(rows(tmp_path)) == len(bounds_cases(12, 2009, "ideal"))


def test_runs_through_can_are_no_runs_on_ideal_kinematics(tmp_path: Path) -> None:
    with opened(tmp_path, bounds_cases(10, 2009, "can")) as results:
        results.keep([(case, drive_batch(FEW[:1])[0][1]) for case in results.missing[:1]])
    with pytest.raises(ConfigError, match="does not have"), opened(tmp_path, bounds_cases(10, 2009, "ideal")):
        pass


@pytest.mark.real_time
def test_two_workers_find_what_one_finds() -> None:
    alone = dict(result for batch in drive_all(FEW, 1) for result in batch)
    assert dict(result for batch in drive_all(FEW, 2) for result in batch) == alone
    assert len(alone) == len(FEW)


@pytest.mark.real_time
def test_a_killed_campaign_goes_on_without_losing_or_doubling_a_run(tmp_path: Path) -> None:
    script = tmp_path / "killed.py"
    script.write_text(KILLED, encoding="utf-8")
    ended = subprocess.run([sys.executable, script, tmp_path], capture_output=True, text=True, check=False,
                           env=os.environ | {"PYTHONPATH": os.getcwd()})  # fmt: skip
    assert ended.returncode == -signal.SIGKILL, ended.stderr
    kept = rows(tmp_path)
    assert 0 < len(kept) < len(FEW)
    drive_missing(FEW, tmp_path, 1, None)
    assert rows(tmp_path)[: len(kept)] == kept
    assert len(rows(tmp_path)) == len({row.split(",driven")[0] for row in rows(tmp_path)}) == len(FEW)


@pytest.mark.real_time
def test_the_workers_of_a_killed_campaign_end_with_it(tmp_path: Path) -> None:
    script = tmp_path / "killed.py"
    script.write_text(KILLED, encoding="utf-8")
    ended = subprocess.run([sys.executable, script, tmp_path], capture_output=True, text=True, check=False,
                           env=os.environ | {"PYTHONPATH": os.getcwd()})  # fmt: skip
    workers = [int(pid) for pid in ended.stdout.split()]
    assert workers
    for pid in workers:
        assert ended_within(pid, 10.0)


def ended_within(pid: int, seconds: float) -> bool:
    """Whether a process is gone, or goes within a time."""
    try:
        descriptor = os.pidfd_open(pid)
    except ProcessLookupError:
        return True
    try:
        return bool(select.select([descriptor], [], [], seconds)[0])
    finally:
        os.close(descriptor)


def test_a_line_that_was_cut_short_is_driven_again(tmp_path: Path) -> None:
    drive_missing(FEW, tmp_path, 1, None)
    whole = rows(tmp_path)
    with (tmp_path / CSV).open("r+b") as file:
        file.truncate((tmp_path / CSV).stat().st_size - 10)
    drive_missing(FEW, tmp_path, 1, None)
    assert rows(tmp_path) == whole


def test_what_is_read_back_is_what_was_driven(tmp_path: Path) -> None:
    found = drive_missing(FEW, tmp_path, 1, None)
    with opened(tmp_path, FEW) as results:
        assert results.in_order() == found
        assert not results.missing


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("0.1.0", "0.0.9"), "driven by canhelm"),
        (("circle", "square"), "is no result"),
        (("part,", "section,"), "has other columns"),
        (("cascade", "thesis"), "is a run that this campaign does not have"),
        ((",driven", ""), "fields"),
    ],
)
def test_results_of_another_campaign_are_not_mixed_in(tmp_path: Path, change: tuple[str, str], told: str) -> None:
    planned = following("thesis", thesis_states(), "cascade", None)[-1:]
    drive_missing(planned, tmp_path, 1, None)
    text = (tmp_path / CSV).read_text(encoding="utf-8")
    (tmp_path / CSV).write_text(text.replace(*change), encoding="utf-8")
    with pytest.raises(ConfigError, match=told), opened(tmp_path, planned):
        pass


def test_two_campaigns_do_not_write_into_one_file(tmp_path: Path) -> None:
    message = "another campaign writes"
    with opened(tmp_path, FEW), pytest.raises(UsageError, match=message), opened(tmp_path, FEW):
        pass


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(UsageError, match="cannot write"), opened(tmp_path / "file", FEW):
        pass


def test_parquet_has_the_same_runs(tmp_path: Path) -> None:
    from pyarrow import parquet

    drive_missing(FEW, tmp_path, 1, None)
    table = parquet.read_table(tmp_path / PARQUET).to_pylist()
    with opened(tmp_path, FEW) as results:
        assert [row["settle_m"] for row in table] == [out.settle_m for out in results.in_order().values()]
        assert write_parquet(results, tmp_path) == tmp_path / PARQUET


@pytest.mark.real_time
@pytest.mark.filterwarnings("ignore")
def test_a_dask_cluster_finds_the_same() -> None:
    from distributed import LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None, host="127.0.0.1") as cluster:
        found = dict(result for batch in drive_all(FEW, 1, cluster.scheduler_address) for result in batch)
    assert found == dict(drive_batch(FEW))


def test_the_commands_print_tables_and_draw_pictures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(cases, "RATES_DEG_M", ())
    assert main(["campaign", "bounds", "--random", "1", "--workers", "1", "--out", str(tmp_path), "--json"]) == 0
    found = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    summary = {(row["law"], row["steering"]): row for row in found if row.get("states") == "thesis"}
    assert summary["thesis", "60°/s"]["failed"] == 10
    assert summary["cascade", "60°/s"]["failed"] == 0
    assert {path.name for path in tmp_path.glob("*.png")} == {"bounds.png", "bounds-runs.png"}


def test_tuning_compares_the_best_pair_with_the_thesis_pair(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(cases, "BENDING_GAINS", (4.0,))
    monkeypatch.setattr(cases, "LOOK_AHEADS_M", (0.425,))
    assert main(["campaign", "tuning", "--workers", "1", "--out", str(tmp_path), "--json"]) == 0
    found = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [row["failed"] for row in found if "failed" in row] == [0, 10], "with an ideal steering, and with 60°/s"
    assert len(list(tmp_path.glob("tuning-*.png"))) == 3


@pytest.mark.parametrize("option", [["--workers", "0"], ["--random", "0"], ["--through", "water"]])
def test_senseless_options_are_refused(option: list[str], tmp_path: Path) -> None:
    assert main(["campaign", "bounds", "--out", str(tmp_path), *option]) == 2


def test_through_can_the_whole_daemon_settles_on_the_line() -> None:
    (case,) = following("thesis", [State("line", 0.1)], "cascade", 60.0, "can")
    ((_, out),) = drive_batch([case])
    assert out.ended == "driven"
    assert out.settle_m is not None
    assert out.settle_m < 1.5
    assert out.worst_position_m < 0.11


@pytest.mark.parametrize("state", [State("circle", 0.2, 10.0), State("line", 0.2, -10.0)])
def test_through_can_the_sensors_noise_does_not_keep_the_cascade_from_settling(state: State) -> None:
    (case,) = following("thesis", [state], "cascade", 60.0, "can")
    ((_, found),) = drive_batch([case])
    assert found.settle_m is not None
    assert found.settle_m < 1.85
    assert found.worst_bending_deg < 32.0


def test_a_run_through_can_is_the_same_every_time() -> None:
    (case,) = following("thesis", [State("circle", heading_deg=5.0)], "cascade", 60.0, "can")
    assert drive_batch([case]) == drive_batch([case])
