"""What commands print, for people and for programs."""

from __future__ import annotations

import io
import json
import math
from typing import Any

import pytest
from rich.console import Console

from canhelm.errors import LimitExceeded
from daemon.cli.motion import progress_text
from daemon.cli.output import plain, say_error, show, words
from daemon.cli.sdo import value_of
from daemon.cli.status import table

STATUS: dict[str, Any] = {
    "robot": "max2d",
    "state": "fault",
    "message": "node 3 (front_left) was lost",
    "nodes": [
        {"node": 1, "name": "rear_right", "node_state": "ready", "state": "enabled", "velocity_rpm": -250.0},
        {"node": 3, "name": "front_left", "node_state": "absent", "status": "no boot-up; is motor power on?"},
        {"node": 5, "name": "rear", "node_state": "ready", "heading_deg": 30.0,
         "fault": {"message": "position error", "remedy": "check the encoder"}},
    ],
    "brakes": [{"name": "rear", "state": "engaged"}],
    "vehicle": {"type": "paired_steer", "heading_deg": {"rear": 30.0}},
    "bus": {"load": 0.12, "dropped_full": 0, "unknown": 4},
    "events": [{"time_s": 1.5, "severity": "warning", "source": "front_left", "message": "lost", "remedy": "power?"}],
}  # fmt: skip


def drawn(status: dict[str, Any]) -> str:
    text = io.StringIO()
    Console(file=text, width=120).print(table(status))
    return text.getvalue()


@pytest.mark.parametrize(
    "told",
    ["max2d  fault  node 3 (front_left) was lost", "-250", "no boot-up; is motor power on?",
     "position error - check the encoder", "rear engaged", "load 0.12, unknown 4", "front_left: lost - power?"],
)  # fmt: skip
def test_the_status_table_tells(told: str) -> None:
    assert told in drawn(STATUS)


def test_the_status_of_a_robot_without_nodes_is_drawn() -> None:
    assert "waiting" in drawn({"robot": "r", "state": "waiting"})


def test_progress_is_what_the_motion_reports() -> None:
    motion = {"motion": "3", "kind": "drive.turn", "drives": ["a"], "phase": "drive", "remaining_m": 0.51234}
    assert progress_text({"state": "active", "motions": [motion]}) == "drive.turn: phase drive, remaining_m 0.512"


def test_several_objects_are_one_json_line_each(capsys: pytest.CaptureFixture[str]) -> None:
    show([{"a": 1}, {"b": math.nan}])
    assert [json.loads(line) for line in capsys.readouterr().out.splitlines()] == [{"a": 1}, {"b": None}]


def test_an_object_without_a_table_is_a_line_a_field(capsys: pytest.CaptureFixture[str]) -> None:
    show({"radius_m": 1.23456, "done": True, "reason": None}, json=False)
    assert capsys.readouterr().out == "radius_m: 1.235\ndone: yes\nreason: -\n"


def test_what_json_does_not_know_becomes_its_text() -> None:
    assert plain({1: (b"x", math.inf)}) == {"1": ["b'x'", None]}


def test_nested_values_are_words_for_people() -> None:
    assert words({"heading_deg": {"rear": 0.5}, "drives": ["a", "b"]}) == "heading_deg rear 0.5, drives a, b"


def test_an_error_tells_the_limit_that_it_broke(capsys: pytest.CaptureFixture[str]) -> None:
    say_error(LimitExceeded("too fast", limit="2 m/s", remedy="ask for less"))
    assert capsys.readouterr().err == "canhelm: too fast (limit: 2 m/s) - ask for less\n"


def test_a_limit_that_the_sentence_tells_is_not_told_twice(capsys: pytest.CaptureFixture[str]) -> None:
    say_error(LimitExceeded("beyond 2 m/s", limit="2 m/s"))
    assert capsys.readouterr().err == "canhelm: beyond 2 m/s\n"


@pytest.mark.parametrize(("text", "value"), [("0x10", 16), ("-20", -20), ("1.5", 1.5), ("save", "save")])
def test_a_value_to_write_is_a_number_where_it_is_one(text: str, value: float | str) -> None:
    assert value_of(text) == value
