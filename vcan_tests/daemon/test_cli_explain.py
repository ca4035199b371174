from __future__ import annotations

import json

import pytest

from daemon.cli.main import main


def objects(capsys: pytest.CaptureFixture[str], *arguments: str) -> list[dict[str, object]]:
    assert main(arguments) == 0
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


def test_explain_prints_one_json_object_a_reading(capsys: pytest.CaptureFixture[str]) -> None:
    assert [reading["kind"] for reading in objects(capsys, "explain", "0x6320")] == ["emcy", "object"]


def test_explain_as_one_kind_prints_that_alone(capsys: pytest.CaptureFixture[str]) -> None:
    readings = objects(capsys, "explain", "0x6320", "--as", "emcy")
    assert [reading["kind"] for reading in readings] == ["emcy"]


def test_the_bytes_of_a_frame_need_no_quotes(capsys: pytest.CaptureFixture[str]) -> None:
    frame = "10 01 41 60 00 01 AB F0"
    assert objects(capsys, "explain", *frame.split()) == objects(capsys, "explain", frame)


def test_many_digits_in_one_word_are_told_how_bytes_are_written(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "100141600001"]) == 2
    assert "serial:100141600001" in capsys.readouterr().err


def test_nothing_to_explain_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain"]) == 2
    assert "0x0337" in capsys.readouterr().err


def test_nonsense_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "zzz"]) == 2
    assert "0x0337" in capsys.readouterr().err


def test_objects_are_listed_by_a_pattern(capsys: pytest.CaptureFixture[str]) -> None:
    rows = objects(capsys, "object", "list", "Following", "--node-type", "epos")
    assert {"0x6065", "0x20F4"} <= {row["object"] for row in rows}


def test_an_object_is_shown_with_cause_and_cure(capsys: pytest.CaptureFixture[str]) -> None:
    (shown,) = objects(capsys, "object", "show", "0x6410/1")
    assert shown["name"] == "continuous_current_limit"
    assert shown["limits"] == "0 .. 5000"
    assert shown["cure"]


def test_an_object_of_two_devices_is_shown_for_both(capsys: pytest.CaptureFixture[str]) -> None:
    assert [shown["node_type"] for shown in objects(capsys, "object", "show", "guard_time")] == ["epos", "encoder"]


@pytest.mark.parametrize("arguments", [("show", "no_such_thing"), ("list", "no_such_thing")])
def test_an_unknown_object_is_wrong_usage(arguments: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["object", *arguments]) == 2
    assert "canhelm object list" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [("explain", "181#3703000000000000"), ("object", "list", "gain"), ("object", "show", "motor_type")],
)
def test_a_terminal_gets_a_table(
    arguments: tuple[str, ...], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("daemon.cli.output.wants_json", lambda _flag: False)
    assert main(arguments) == 0
    out = capsys.readouterr().out
    assert "{" not in out
    assert out.strip()
