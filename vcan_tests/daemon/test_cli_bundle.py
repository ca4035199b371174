"""The bundle for a report of a problem: what is in it, with and without a daemon."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import pytest

from daemon.cli.main import main
from vcan_tests.daemon.fake_backend import FakeBackend, served


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The state folder of a person, with one run in it."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setattr("daemon.runs.store.SYSTEM_FOLDER", tmp_path / "none")
    run = tmp_path / "state" / "canhelm" / "max2d" / "runs" / "0001"
    run.mkdir(parents=True)
    (run / "run.yaml").write_text("robot: max2d\nbegun: '2026-01-01'\n")
    (run / "frames.log").write_text("(0.0) vcan0 080#\n" * 10)
    return tmp_path


def packed(folder: Path, *options: str) -> dict[str, bytes]:
    """The files of a new bundle by their names."""
    path = folder / "problem.zip"
    assert main(["doctor", "--bundle", str(path), *options]) in (0, 1)
    with zipfile.ZipFile(path) as bundle:
        return {name: bundle.read(name) for name in bundle.namelist()}


def test_a_bundle_holds_versions_findings_journal_and_the_last_run(home: Path) -> None:
    files = packed(home)
    assert {"versions.json", "doctor.json", "journal.txt", "run/run.yaml", "run/frames.log"} <= files.keys()
    assert json.loads(files["versions.json"])["canhelm"]
    assert any(finding["check"] == "python" for finding in json.loads(files["doctor.json"]))


def test_a_bundle_holds_the_last_fault_as_well(home: Path) -> None:
    runs = home / "state" / "canhelm" / "max2d" / "runs"
    for number in (2, 3):
        (runs / f"000{number}").mkdir()
        facts = f"robot: max2d\nkind: fault\nbegun: '2025-01-0{number}'\n"
        (runs / f"000{number}" / "run.yaml").write_text(facts)
    files = packed(home)
    assert (b"2026-01-01" in files["run/run.yaml"], b"2025-01-03" in files["fault/run.yaml"]) == (True, True)


def test_a_bundle_holds_the_status_and_the_profile_of_a_daemon(home: Path) -> None:
    class Known(FakeBackend):
        def status(self) -> dict[str, Any]:
            return {**super().status(), "profile_file": str(home / "lab1.yaml")}

    (home / "lab1.yaml").write_text("extends: max2d\n")
    with served(Known(), home / "lab1.sock") as server:
        files = packed(home, "--socket", str(server.path))
    assert json.loads(files["lab1/status.json"])["state"]
    assert files["lab1/lab1.yaml"] == b"extends: max2d\n"


def test_a_bundle_holds_nothing_of_the_environment(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SECRET_TOKEN", "abracadabra")
    assert not any(b"abracadabra" in content for content in packed(home).values())


def test_only_the_end_of_a_long_file_goes_along(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("daemon.cli.bundle.TAIL_BYTES", 34)
    assert packed(home)["run/frames.log"] == b"(0.0) vcan0 080#\n" * 2


def test_a_file_that_is_there_is_not_overwritten(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (home / "problem.zip").write_text("precious")
    assert main(["doctor", "--bundle", str(home / "problem.zip")]) == 2
    assert "cannot write" in capsys.readouterr().err
    assert (home / "problem.zip").read_text() == "precious"
