"""What commands print, for people and for programs."""

from __future__ import annotations

import io
import json
import math
from typing import Any

import pytest
from rich.console import Console

from canhelm.errors import LimitExceeded
from daemon.cli.motion import cut, progress_text
from daemon.cli.output import plain, say, say_error, show, words
from daemon.cli.sdo import value_of
from daemon.cli.status import table

STATUS: dict[str, Any] = {
    "robot": "max2d",
    "role": "drive",
    "holder": {"client": "alice (pid 77: canhelm drive joystick)"},
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


def drawn(status: dict[str, Any], width: int = 120) -> str:
    text = io.StringIO()
    Console(file=text, width=width).print(table(status))
    return text.getvalue()


@pytest.mark.parametrize(
    "told",
    ["max2d  fault  node 3 (front_left) was lost  (your role: drive)",
     "held by alice (pid 77: canhelm drive joystick)\n",
     "-250", "no boot-up; is motor power on?",
     "position error - check the encoder", "rear engaged", "bus: load 0.12\n", "bus trouble: unknown 4\n",
     "front_left: lost - power?"],
)  # fmt: skip
def test_the_status_table_tells(told: str) -> None:
    assert told in drawn(STATUS)


def test_what_is_empty_or_zero_is_left_out_of_the_status_for_people() -> None:
    bus = {"load": 0.0, "silent_nodes": [], "line_down": None, "resyncs": 0}
    assert drawn({"robot": "r", "state": "idle", "bus": bus}).splitlines()[-1] == "bus: load 0"


def test_the_first_section_and_piece_of_a_path_are_told() -> None:
    motions = [{"kind": "drive.path", "section": 0, "piece": 0, "late": 0}]
    told = drawn({"robot": "r", "state": "active", "motions": motions}).splitlines()[-1]
    assert told == "motions: kind drive.path, section 0, piece 0"


def test_a_serial_line_is_told_in_groups_with_a_line_each() -> None:
    bus = {"load": 0.3, "baud": 115200, "planned_hz": 16.1, "silent_line_stop_s": 1.87, "silent_nodes": [3]}
    told = drawn({"robot": "r", "state": "idle", "bus": bus}).splitlines()[-4:]
    plan = "line plan: planned_hz 16.1, silent_line_stop_s 1.87"
    assert told == ["bus: load 0.3", "line: baud 115200", plan, "bus trouble: silent_nodes 3"]


def test_the_status_of_a_robot_without_nodes_is_drawn() -> None:
    assert "waiting" in drawn({"robot": "r", "state": "waiting"})


def test_progress_is_what_the_motion_reports() -> None:
    motion = {"motion": "3", "kind": "drive.turn", "drives": ["a"], "phase": "drive", "remaining_m": 0.51234}
    assert progress_text({"state": "active", "motions": [motion]}) == "drive.turn: drive, remaining_m 0.512"


TURNING = {
    "motion": "1", "kind": "steer", "drives": ["a"], "phase": "turning_pair", "pair": "front", "speed_m_s": 0.0,
    "heading_error_deg": [0.0, 0.2931], "icr_m": None, "warnings": [], "mismatch_deg": [0.0, 0.0, 0.0, 0.0],
}  # fmt: skip


def test_progress_shows_its_numbers_on_sixty_columns() -> None:
    line = cut(progress_text({"motions": [TURNING]}), 59)
    assert line == "steer: turning_pair, front, heading_error_deg 0, 0.293"


def test_a_line_that_is_too_long_is_cut_after_a_whole_item() -> None:
    assert [cut("speed 0.4, way 0.9", width) for width in (18, 17, 9)] == [
        "speed 0.4, way 0.9",
        "speed 0.4",
        "speed 0.4",
    ]


def test_sixty_columns_show_every_number_and_state_of_a_node() -> None:
    node = {"node": 4, "name": "front_right", "device": "epos24_5", "node_state": "ready", "state": "quick_stop",
            "velocity_rpm": -1250.0, "speed_m_s": -0.0028, "current_a": -1.129}  # fmt: skip
    encoder = {"node": 6, "name": "front", "device": "cia406", "node_state": "ready", "heading_deg": -29.71}
    head, *rows = drawn({"robot": "r", "state": "active", "nodes": [node, encoder]}, 60).splitlines()[1:4]
    assert head.split() == ["node", "name", "state", "rpm", "m/s", "A", "heading", "°"]
    assert [row.split() for row in rows] == [
        ["4", "front_right", "quick_stop", "-1250", "-0.0028", "-1.129", "-"],
        ["6", "front", "ready", "-", "-", "-", "-29.71"],
    ]


def test_several_objects_are_one_json_line_each(capsys: pytest.CaptureFixture[str]) -> None:
    show([{"a": 1}, {"b": math.nan}])
    assert [json.loads(line) for line in capsys.readouterr().out.splitlines()] == [{"a": 1}, {"b": None}]


def test_an_object_without_a_table_is_a_line_a_field(capsys: pytest.CaptureFixture[str]) -> None:
    show({"radius_m": 1.23456, "done": True, "reason": None}, json=False)
    assert capsys.readouterr().out == "radius_m: 1.235\ndone: yes\nreason: -\n"


def test_what_is_empty_has_no_line_for_people(capsys: pytest.CaptureFixture[str]) -> None:
    show({"message": "", "warnings": [], "result": {"slips": []}, "asked": {"to": [], "rate_hz": 0.0}}, json=False)
    assert capsys.readouterr().out == "asked: rate_hz 0\n"


def test_what_json_does_not_know_becomes_its_text() -> None:
    assert plain({1: (b"x", math.inf)}) == {"1": ["b'x'", None]}


def test_nested_values_are_words_for_people() -> None:
    assert words({"heading_deg": {"rear": 0.5}, "drives": ["a", "b"]}) == "heading_deg rear 0.5, drives a, b"


def test_a_large_number_keeps_its_digits_for_people() -> None:
    assert words([1795344000.25, 12345.6, 1234.5, 0.12345]) == "1795344000, 12346, 1234, 0.1235"


def test_an_error_tells_the_limit_that_it_broke(capsys: pytest.CaptureFixture[str]) -> None:
    say_error(LimitExceeded("too fast", limit="2 m/s", remedy="ask for less"))
    assert capsys.readouterr().err == "canhelm: too fast (limit: 2 m/s) - ask for less\n"


def test_a_limit_that_the_sentence_tells_is_not_told_twice(capsys: pytest.CaptureFixture[str]) -> None:
    say_error(LimitExceeded("beyond 2 m/s", limit="2 m/s"))
    assert capsys.readouterr().err == "canhelm: beyond 2 m/s\n"


@pytest.mark.parametrize(("text", "value"), [("0x10", 16), ("-20", -20), ("1.5", 1.5), ("save", "save")])
def test_a_value_to_write_is_a_number_where_it_is_one(text: str, value: float | str) -> None:
    assert value_of(text) == value


def test_a_list_of_objects_has_a_line_each_for_people(capsys: pytest.CaptureFixture[str]) -> None:
    show({"stops": 1, "pieces": [{"kind": "line", "length_m": 0.5}, {"kind": "arc", "length_m": 1.0}]}, json=False)
    assert capsys.readouterr().out.splitlines() == [
        "stops: 1",
        "pieces:",
        "  0: kind line, length_m 0.5",
        "  1: kind arc, length_m 1",
    ]


def test_a_message_gives_no_orders_to_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    say("key '\x1b[2J\x9bm' stands\there\ntwice")
    assert capsys.readouterr().err == "canhelm: key '\ufffd[2J\ufffdm' stands\there\ntwice\n"
