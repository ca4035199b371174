"""The page on faults: every kind stands there with an example, and the examples are taken by the simulated robots."""

from __future__ import annotations

import os
import re
from pathlib import Path

import msgspec
import pytest

from daemon.api.methods import METHODS
from daemon.api.parameters import validate
from daemon.cli.main import main
from profiles.faults import KIND_NAMES, Fault, objections
from profiles.loader import load
from vcan_tests.daemon.fake_backend import FakeBackend, served

PAGE = Path(__file__).resolve().parents[2] / "docs" / "faults.md"
EXAMPLES = dict(re.findall(r"^\| `(\w+)` \| .* \| `(canhelm sim fault .*)` \|$", PAGE.read_text("utf-8"), re.M))
MAX2D, NXT, NODE_3 = load("max2d").profile, load("nxt").profile, "front_left"


def test_the_page_has_every_kind_with_an_example() -> None:
    assert tuple(EXAMPLES) == KIND_NAMES


@pytest.mark.parametrize("kind", KIND_NAMES)
def test_an_example_is_a_fault_that_its_robot_can_have(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    backend = FakeBackend()
    with served(backend, tmp_path / "robot.sock") as server:
        monkeypatch.setenv("CANHELM_SOCKET", os.fspath(server.path))
        assert main(EXAMPLES[kind].split()[1:]) == 0
    method, sent, _ = backend.calls[-1]
    given = {key: value for key, value in validate(METHODS[method], dict(sent)).items() if value is not None}
    if given.get("part") == 3:
        given["part"] = NODE_3
    fault = msgspec.convert(given, Fault)
    assert fault.kind == kind
    assert list(objections(fault, NXT if kind == "brick_lost" else MAX2D)) == []
