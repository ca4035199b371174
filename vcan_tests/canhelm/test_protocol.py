"""Lines of the protocol, and the choice of a socket."""

from __future__ import annotations

import math
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm import protocol
from canhelm.errors import CanhelmError, DaemonNotRunning, LimitExceeded, UsageError

VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**63)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=10,
)


@given(st.dictionaries(st.text(), VALUES))
def test_what_is_made_is_parsed_back(params: dict[str, Any]) -> None:
    line = protocol.make_request(7, "steer", params)
    assert protocol.parse_message(line) == {"jsonrpc": "2.0", "id": 7, "method": "steer", "params": params}


@given(st.dictionaries(st.text(), VALUES))
def test_a_message_is_one_line(params: dict[str, Any]) -> None:
    assert protocol.make_notification("status", params).count(b"\n") == 1


@given(st.binary())
def test_bytes_that_are_no_message_give_a_reason(line: bytes) -> None:
    assert isinstance(protocol.parse_message(line), dict | str)


def test_numbers_without_a_word_in_json_become_null() -> None:
    line = protocol.make_notification("status", {"a": [math.inf, {"b": math.nan}], "c": 1.5})
    parsed = protocol.parse_message(line)
    assert isinstance(parsed, dict)
    assert parsed["params"] == {"a": [None, {"b": None}], "c": 1.5}


def test_an_error_arrives_as_the_class_that_was_raised() -> None:
    error = LimitExceeded("too fast", node=3, limit=1.2, remedy="slower")
    answer = protocol.parse_message(protocol.make_error(1, error.rpc_code, error.message, error.data()))
    assert isinstance(answer, dict)
    with pytest.raises(LimitExceeded, match="too fast") as caught:
        protocol.result_of(answer)
    assert (caught.value.node, caught.value.limit, caught.value.remedy) == (3, 1.2, "slower")


def test_an_error_of_an_unknown_class_is_still_an_error() -> None:
    with pytest.raises(CanhelmError, match="new"):
        protocol.result_of({"error": {"code": 1, "message": "new", "data": {"type": "FromTheFuture"}}})


# -- the choice of a socket -------------------------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """This user's folder of sockets; the system has none."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    for name in ("RUNTIME_DIRECTORY", "CANHELM_SOCKET", "CANHELM_ROBOT"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(protocol, "SYSTEM_FOLDER", tmp_path / "no-system")
    (tmp_path / "canhelm").mkdir()
    return tmp_path / "canhelm"


@pytest.fixture
def listeners() -> Iterator[list[socket.socket]]:
    opened: list[socket.socket] = []
    yield opened
    for listener in opened:
        listener.close()


def listen(path: Path, listeners: list[socket.socket]) -> None:
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(os.fspath(path))
    listener.listen()
    listeners.append(listener)


def test_a_daemon_of_a_user_listens_in_their_runtime_folder(folder: Path) -> None:
    assert protocol.default_socket("max2d") == folder / "max2d.sock"


def test_a_service_listens_in_the_folder_it_is_given(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RUNTIME_DIRECTORY", "/run/canhelm")
    assert protocol.default_socket("max2d") == Path("/run/canhelm/max2d.sock")


def test_without_a_runtime_folder_a_user_has_one_in_tmp(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    assert protocol.user_folder() == Path(f"/tmp/canhelm-{os.getuid()}")


@pytest.mark.parametrize("name", ["../max2d", "", ".hidden", "a/b", "a b", "x" * 65])
def test_a_name_that_is_no_file_name_is_refused(name: str) -> None:
    with pytest.raises(UsageError):
        protocol.default_socket(name)


def test_a_named_socket_is_taken_as_it_is() -> None:
    assert protocol.choose_socket("/a/b.sock", "max2d") == Path("/a/b.sock")


def test_the_environment_names_the_socket_where_the_caller_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CANHELM_SOCKET", "/a/c.sock")
    assert protocol.choose_socket() == Path("/a/c.sock")
    assert protocol.choose_socket("/a/b.sock") == Path("/a/b.sock")


def test_the_only_one_running_is_chosen(folder: Path, listeners: list[socket.socket]) -> None:
    (folder / "dead.sock").touch()
    listen(folder / "max2d.sock", listeners)
    assert protocol.choose_socket() == folder / "max2d.sock"


def test_of_several_running_none_is_chosen(folder: Path, listeners: list[socket.socket]) -> None:
    listen(folder / "a.sock", listeners)
    listen(folder / "b.sock", listeners)
    with pytest.raises(UsageError, match="a, b"):
        protocol.choose_socket()


def test_a_robot_is_found_by_name(folder: Path, listeners: list[socket.socket]) -> None:
    listen(folder / "a.sock", listeners)
    assert protocol.choose_socket(robot="a") == folder / "a.sock"


def test_where_none_runs_the_remedy_starts_one(folder: Path) -> None:
    with pytest.raises(DaemonNotRunning) as caught:
        protocol.choose_socket()
    assert "canhelm run" in str(caught.value.remedy)


REASONS = [
    (b"\xff\xfe", "not JSON: byte 0 is not UTF-8"),
    (b"{", "not JSON: expecting property name enclosed in double quotes at character 1"),
    (b'{"a": NaN}', "not JSON: NaN is not JSON"),
    (b"[" * 60_000, "not JSON: it is nested too deeply"),
]


@pytest.mark.parametrize(("line", "reason"), REASONS, ids=["bytes", "syntax", "NaN", "depth"])
def test_the_reason_why_a_line_is_no_json_is_in_words(line: bytes, reason: str) -> None:
    assert protocol.parse_message(line) == reason


def test_a_number_that_json_cannot_carry_is_named() -> None:
    with pytest.raises(UsageError, match="steer: angle_deg is nan: not a finite number"):
        protocol.make_request(1, "steer", {"pair": "front", "angle_deg": math.nan})


def test_the_way_to_start_a_daemon_names_the_socket_that_was_asked_for(tmp_path: Path) -> None:
    with pytest.raises(DaemonNotRunning) as missing:
        protocol.open_socket(tmp_path / "here.sock")
    assert f"--socket {tmp_path / 'here.sock'}" in str(missing.value)
