"""``canhelm config`` and ``canhelm object``: files, previews, and what is printed."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from daemon.api.server import Server
from daemon.cli.main import main
from drivers.canopen.eds import load_eds
from drivers.epos.objects import OBJECTS
from vcan_tests.daemon.fake_backend import FakeBackend, served

DUMP = {
    "node": 1,
    "name": "rear_right",
    "bit_rate": 1_000_000,
    "product_code": 0x6210_2011,
    "values": {"0x1400/1": 0x201, "0x6083": 4000, "0x607D/1": -5},
}
CHANGE = {"object": "0x6083", "name": "profile_acceleration", "was": 1, "wanted": 4000, "unit": "rpm/s", "note": ""}
DONE = {
    "node": 1,
    "dry_run": False,
    "saved": True,
    "changes": [CHANGE],
    "notes": ["a note"],
    "status": "node 1 is ready",
}


class ConfigBackend(FakeBackend):
    """Answers ``config.*`` as one drive would."""

    async def call(self, method: str, params: dict[str, Any], lease: str | None) -> dict[str, Any]:
        answer = await super().call(method, params, lease)
        answers: dict[str, dict[str, Any]] = {
            "config.dump": DUMP,
            "config.backup": {"drives": [DUMP]},
            "config.diff": {"compared": 3, "differences": [CHANGE], "notes": []},
            "config.apply": DONE | {"dry_run": params.get("dry_run")},
            "config.restore": DONE | {"dry_run": params.get("dry_run")},
        }
        return answers.get(method, answer)

    @property
    def asked(self) -> list[tuple[str, dict[str, Any]]]:
        return [(method, params) for method, params, _ in self.calls if method.startswith("config")]


@pytest.fixture
def backend(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ConfigBackend]:
    backend = ConfigBackend()
    with served(backend, tmp_path / "robot.sock") as server:
        assert isinstance(server, Server)
        monkeypatch.setenv("CANHELM_SOCKET", os.fspath(server.path))
        yield backend


def run(*line: object) -> int:
    return main([str(word) for word in line])


def test_a_dump_is_a_dcf_file_that_the_library_canopen_reads(backend: ConfigBackend, tmp_path: Path) -> None:
    assert run("config", "dump", "rear_right", tmp_path / "old.dcf") == 0
    loaded = load_eds(tmp_path / "old.dcf")
    variables = [loaded.dictionary.get_variable(index, 1) for index in (0x1400, 0x607D)]
    values = [variable.value for variable in variables if variable is not None]
    assert (loaded.warnings, loaded.dictionary.node_id, values) == ((), 1, [0x201, -5])


def test_a_dump_is_applied_with_the_same_values(backend: ConfigBackend, tmp_path: Path) -> None:
    file = tmp_path / "old.dcf"
    run("config", "dump", 1, file)
    assert run("config", "apply", "rear_right", file, "--dry-run") == 0
    _, sent = backend.asked[-1]
    assert sent["values"] == {"0x1400/1": 0x201, "0x6083/0": 4000, "0x607D/1": -5}
    assert (sent["product_code"], sent["dry_run"], sent["save"]) == (0x6210_2011, True, False)


def test_without_a_file_the_profile_is_applied(backend: ConfigBackend) -> None:
    assert run("config", "apply", 1, "--save") == 0
    assert backend.asked == [
        ("config.apply", {"node": 1, "values": None, "product_code": None, "dry_run": False, "save": True})
    ]


def test_differences_are_shown_and_are_exit_code_1(backend: ConfigBackend, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("config", "diff", 1) == 1
    out, err = capsys.readouterr()
    assert json.loads(out) == CHANGE
    assert "1 of 3 settings differ" in err


def test_a_backup_is_a_file_a_drive_and_restores_it_in_one_command(backend: ConfigBackend, tmp_path: Path) -> None:
    assert run("config", "backup", tmp_path / "settings") == 0
    assert [path.name for path in (tmp_path / "settings").iterdir()] == ["node-1.dcf"]
    assert run("config", "restore", tmp_path / "settings", "rear_right", "--yes") == 0
    method, sent = backend.asked[-1]
    assert (method, sent["dry_run"], len(sent["values"])) == ("config.restore", False, 3)


def test_a_dump_makes_no_folder_and_says_how_to(
    backend: ConfigBackend, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("config", "dump", 1, tmp_path / "none" / "x.dcf") == 7
    assert capsys.readouterr().err.endswith(f"for x.dcf - mkdir -p {tmp_path / 'none'}\n")
    assert (list(tmp_path.glob("none")), backend.asked) == ([], [])


def test_a_backup_into_what_is_no_folder_is_refused_before_drives_are_asked(
    backend: ConfigBackend, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("")
    assert run("config", "backup", tmp_path / "file") == 7
    assert backend.asked == []


def test_restoring_shows_the_writes_and_wants_a_word_of_consent(
    backend: ConfigBackend, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run("config", "backup", tmp_path)
    capsys.readouterr()
    assert run("config", "restore", tmp_path, 1) == 2
    out, err = capsys.readouterr()
    assert json.loads(out)["changes"] == [CHANGE]
    assert "--yes" in err
    assert [params["dry_run"] for method, params in backend.asked if method == "config.restore"] == [True]


def test_the_table_for_people_says_what_was_done(
    backend: ConfigBackend, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CANHELM_JSON", "false")
    assert run("config", "apply", 1, "--save") == 0
    out, err = capsys.readouterr()
    assert "profile_acceleration" in out
    assert "1 settings written and read back; saved, restarted, and read back again" in err
    assert "a note" in err


def test_a_vendors_file_is_applied_with_warnings_that_name_the_line(
    backend: ConfigBackend, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "vendor.dcf"
    file.write_text("[6083]\nParameterName=a\nDataType=0x7\nAccessType=rw\nParameterValue=007\n")
    assert run("config", "apply", 1, file) == 0
    assert backend.asked[-1][1]["values"] == {"0x6083/0": 7}
    assert "vendor.dcf:5: ParameterValue=007 in [6083] is read as 7" in capsys.readouterr().err


@pytest.mark.parametrize("content", [None, "", "[6083]\nParameterName=a\nDataType=0x7\nAccessType=rw\n"])
def test_a_file_without_settings_is_exit_code_7(backend: ConfigBackend, tmp_path: Path, content: str | None) -> None:
    file = tmp_path / "vendor.dcf"
    if content is not None:
        file.write_text(content)
    assert run("config", "apply", 1, file) == 7
    assert not backend.asked


def test_an_index_shows_all_its_entries(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("object", "show", "0x2078") == 0
    shown = [json.loads(line)["object"] for line in capsys.readouterr().out.splitlines()]
    assert shown == ["0x2078", "0x2078/1", "0x2078/2", "0x2078/3"]


def test_a_misspelt_object_is_told_the_names_that_come_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("object", "show", "statusord") == 2
    assert capsys.readouterr().err == "canhelm: no object 'statusord' - did you mean statusword?\n"


def test_an_object_of_later_firmware_is_marked(capsys: pytest.CaptureFixture[str]) -> None:
    run("object", "show", "0x6067")
    assert "later firmware" in json.loads(capsys.readouterr().out)["firmware"]


def test_the_exported_dictionary_is_listed_like_the_own_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("object", "export", tmp_path / "epos.eds") == 0
    assert run("object", "list", "--eds", tmp_path / "epos.eds") == 0
    listed = {json.loads(line)["object"] for line in capsys.readouterr().out.splitlines()}
    assert listed == {entry.address for entry in OBJECTS.objects if entry.firmware == "2011h"}


def test_a_broken_vendor_file_is_listed_with_warnings(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "vendor.eds"
    file.write_text("[2000sub1]\nParameterName=Speed\nDataType=0x3\nAccessType=rw\nDefaultValue=001\n")
    assert run("object", "show", "0x2000/1", "--eds", file) == 0
    out, err = capsys.readouterr()
    assert (json.loads(out)["name"], json.loads(out)["default"]) == ("object_2000_speed", "1")
    assert "vendor.eds:1: [2000sub1] has no [2000]; one was added" in err
