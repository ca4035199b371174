"""How a terminal shows the faults of a simulated network."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from typing import Any

import pytest

from daemon.api.server import Server
from vcan_tests.daemon.cli.shell import run
from vcan_tests.daemon.fake_backend import FakeBackend


def answering(monkeypatch: pytest.MonkeyPatch, backend: FakeBackend, answer: Mapping[str, Any]) -> None:
    async def call(method: str, params: dict[str, Any], lease: str | None) -> dict[str, Any]:
        return dict(answer)

    monkeypatch.setattr(backend, "call", call)


@pytest.mark.parametrize(
    ("field", "number", "shown"),
    [("cob_id", 0x80, "0x080"), ("code", 0x06090030, "0x06090030"), ("code", 0x4210, "0x4210"), ("value", 7, "0x7")],
)
def test_a_fault_is_echoed_in_hexadecimal_on_a_terminal_and_as_a_number_to_programs(
    server: Server,
    backend: FakeBackend,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    field: str,
    number: int,
    shown: str,
) -> None:
    answering(monkeypatch, backend, {"fault": 1, field: number})
    assert run("sim fault lose --json") == 0
    assert json.loads(capsys.readouterr().out) == {"fault": 1, field: number}
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert run("sim fault lose") == 0
    assert f"{field}: {shown}\n" in capsys.readouterr().out


def test_no_faults_are_a_sentence_and_no_empty_table(
    server: Server, backend: FakeBackend, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    answering(monkeypatch, backend, {"faults": []})
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert run("sim faults") == 0
    told = capsys.readouterr()
    assert (told.out, "no fault is set" in told.err) == ("", True)
