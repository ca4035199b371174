"""Driving path files, recording ways and fitting them, as a person does it with a daemon of its own."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from canhelm.errors import DaemonNotRunning
from daemon.cli.main import main
from daemon.cli.options import Options
from profiles.path_file import load_path_file
from vcan_tests.daemon.test_processes import Bench

PATIENT_SEMITRAILER = """
schema_version: 1
name: semitrailer
extends: robots/semitrailer
network: {guard_time_ms: 1000, life_time_factor: 4}
"""


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    bench = Bench(tmp_path_factory.mktemp("semitrailer"), profile_text=PATIENT_SEMITRAILER)
    yield bench
    bench.end()


def printed(output: str) -> dict[str, Any]:
    (line,) = output.splitlines()
    return dict(json.loads(line))


def written(folder: Path, text: str) -> str:
    file = folder / "way.yaml"
    file.write_text(text)
    return str(file)


@pytest.mark.real_time
def test_a_bad_piece_is_told_with_file_and_line(bench: Bench, tmp_path: Path) -> None:
    file = written(tmp_path, "pieces:\n  - {line_m: 1}\n  - {arc_deg: 90, radius_m: 0.3}\n")
    done = bench.canhelm("drive", "path", file)
    assert done.returncode == 1
    assert f"{file}:3: piece 1 has a radius of 0.300 m" in done.stderr


@pytest.mark.real_time
def test_a_broken_file_is_told_before_anybody_is_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = written(tmp_path, "pieces:\n  - {lime_m: 1}\n")
    assert main(["drive", "path", file, "--socket", str(tmp_path / "none.sock")]) == 2
    assert f"{file}:2: pieces[0]" in capsys.readouterr().err


@pytest.mark.real_time
def test_a_path_of_many_requests_goes_over_the_socket(bench: Bench, tmp_path: Path) -> None:
    rows = ["- {line_m: 0.01}", "- {arc_deg: 0.5, radius_m: 1.5}"] * 5_000
    done = bench.canhelm("drive", "path", written(tmp_path, "pieces:\n" + "\n".join(rows)), "--dry-run")
    assert printed(done.stdout)["pieces"] == 10_000


@pytest.mark.real_time
def test_a_recorded_way_is_fitted_and_can_be_driven(bench: Bench, tmp_path: Path) -> None:
    record, fitted = str(tmp_path / "way.csv"), str(tmp_path / "fitted.yaml")
    way = written(tmp_path, "pieces:\n  - {line_m: 0.4}\n  - {arc_deg: 20, radius_m: 1}\n")
    with bench.begin("drive", "record", record, "--rate", "20") as recording:
        assert recording.stderr is not None
        assert "recording" in recording.stderr.readline()
        driven = bench.canhelm("drive", "path", way)
        recording.send_signal(signal.SIGINT)
    assert printed(driven.stdout)["end_error_m"] < 0.01
    assert recording.returncode == 0
    done = bench.canhelm("drive", "fit", record, fitted)
    assert printed(done.stdout)["deviation_m"] <= 0.01
    assert 1 <= printed(done.stdout)["pieces"] <= 6
    assert "the path begins 0.7" in bench.canhelm("drive", "path", fitted, "--dry-run").stderr
    from_here = [row for row in Path(fitted).read_text().splitlines(keepends=True) if not row.startswith("start:")]
    told = bench.canhelm("drive", "path", written(tmp_path, "".join(from_here)), "--dry-run")
    assert printed(told.stdout)["length_m"] == pytest.approx(0.4 + 0.349, abs=0.02)


def test_a_record_with_a_cusp_becomes_a_path_with_a_cusp(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ways = [step * 0.02 for step in range(51)]
    rows = [f"0,{x},0,0,{x - 0.602},0,0" for x in (*ways, *reversed(ways))]
    record = tmp_path / "way.csv"
    record.write_text("\n".join(rows))
    assert main(["drive", "fit", str(record), str(tmp_path / "way.yaml")]) == 0
    assert printed(capsys.readouterr().out)["pieces"] == 2
    there, back = load_path_file(tmp_path / "way.yaml").spec.pieces
    assert (there.drive, back.drive) == ("forward", "backward")
    assert [there.line_m, back.line_m] == pytest.approx([1.0, 1.0], abs=0.03)
    assert back.from_m == pytest.approx((0.398, 0.0))


def test_the_heading_of_a_fitted_path_is_within_half_a_turn(tmp_path: Path) -> None:
    record = tmp_path / "way.csv"
    record.write_text("\n".join(f"0,0,{step * 0.02},810,,," for step in range(51)))
    assert main(["drive", "fit", str(record), str(tmp_path / "way.yaml")]) == 0
    start = load_path_file(tmp_path / "way.yaml").spec.start
    assert start is not None
    assert start.heading_deg == pytest.approx(90.0, abs=0.1)


@pytest.mark.parametrize(
    "text", ["", "0,0,0,0,,,\n0,0,0,0,,,\n", "time\n", "0,1,x,0,,,\n", "0,1,inf,0,,,\n", "0,1e185,0,0,,,\n"]
)
def test_what_is_no_record_is_refused(text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record = tmp_path / "way.csv"
    record.write_text(text)
    assert main(["drive", "fit", str(record), str(tmp_path / "way.yaml")]) == 2
    assert str(record) in capsys.readouterr().err
    assert not (tmp_path / "way.yaml").exists()


class HangsUp:
    """A client of a daemon that is lost after two samples."""

    def __enter__(self) -> HangsUp:
        return self

    def __exit__(self, *_: object) -> None:
        return

    def status(self) -> dict[str, Any]:
        return {"vehicle": {"odometry": {"x_m": 0.0, "y_m": 0.0, "yaw_deg": 0.0}}}

    def notifications(self, _: float) -> Iterator[tuple[str, dict[str, Any]]]:
        for time_s in (1.0, 1.1):
            yield "status", {"time_s": time_s, **self.status()}
        raise DaemonNotRunning("the daemon hung up", remedy="look at its last words")


def test_a_record_whose_daemon_is_lost_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(Options, "client", lambda _: HangsUp())
    record = tmp_path / "way.csv"
    assert main(["drive", "record", str(record)]) == 3
    assert f"the daemon hung up; {record} is kept with 2 rows" in capsys.readouterr().err
    assert len(record.read_text().splitlines()) == 3


def test_a_tolerance_that_makes_no_sense_is_refused(tmp_path: Path) -> None:
    assert main(["drive", "fit", str(tmp_path / "a"), str(tmp_path / "b"), "--tolerance", "0"]) == 2


@pytest.mark.parametrize("data", [b"\x89PNG\xff\xfe", b"a" * 200_000, b"0,0,0\x00,0\n"])
def test_a_file_that_is_no_text_is_no_record(data: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record = tmp_path / "way.csv"
    record.write_bytes(data)
    assert main(["drive", "fit", str(record), str(tmp_path / "way.yaml")]) == 2
    assert str(record) in capsys.readouterr().err


def test_fitting_overwrites_no_path_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record, kept = tmp_path / "way.csv", tmp_path / "way.yaml"
    record.write_text("\n".join(f"0,{step * 0.02},0,0,,," for step in range(50)))
    kept.write_text("mine")
    assert main(["drive", "fit", str(record), str(kept)]) == 2
    assert f"{kept} exists already" in capsys.readouterr().err
    assert kept.read_text() == "mine"


@pytest.mark.real_time
def test_recording_overwrites_no_record(bench: Bench, tmp_path: Path) -> None:
    kept = tmp_path / "way.csv"
    kept.write_text("mine")
    done = bench.canhelm("drive", "record", str(kept), "--duration", "0.1")
    assert (done.returncode, kept.read_text()) == (2, "mine")
    assert "exists already" in done.stderr
