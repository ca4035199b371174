"""The page on faults: every kind stands there with an example, and the examples are taken by the simulated robots."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path

import msgspec
import pytest

from daemon.api.methods import METHODS
from daemon.api.parameters import validate
from daemon.cli.main import main
from daemon.runtime.clock import run_virtual
from profiles.faults import KIND_NAMES, Fault, load_faults, objections
from profiles.loader import load
from profiles.schema import Profile
from vcan_tests.daemon.fake_backend import FakeBackend, served
from vcan_tests.docs.pages import blocks
from vcan_tests.long_life.loop import run_with_sockets
from vcan_tests.robot import running_robot

PAGE = Path(__file__).resolve().parents[2] / "docs" / "faults.md"
EXAMPLES = dict(re.findall(r"^\| `(\w+)` \| .* \| `(canhelm sim fault .*)` \|$", PAGE.read_text("utf-8"), re.M))
MAX2D, NXT, NODE_3 = load("max2d").profile, load("nxt").profile, "front_left"


def test_the_page_has_every_kind_with_an_example() -> None:
    assert tuple(EXAMPLES) == KIND_NAMES


@pytest.mark.parametrize("kind", KIND_NAMES)
def test_an_example_is_a_fault_that_its_robot_can_have(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fault = example(kind, tmp_path, monkeypatch)
    assert fault.kind == kind
    assert list(objections(fault, robot_of(kind))) == []


@pytest.mark.parametrize("kind", KIND_NAMES)
def test_an_example_strikes_a_robot_that_boots(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bus = "rs232" if kind == "serial_noise" else "simulated"
    fault = example(kind, tmp_path, monkeypatch)
    run_with_sockets(strike(robot_of(kind), [fault], tmp_path / "simulated.sock", bus))


def test_the_example_of_a_wrong_identity_is_found_out_at_boot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fault = example("wrong_identity", tmp_path, monkeypatch)

    async def boot() -> None:
        async with running_robot(booted=False, expect_errors=True) as robot:
            await robot.call("simulation.fault", **msgspec.to_builtins(fault))
            await robot.until(lambda: "(vendor_id)" in str(robot.app.service.status()), 5.0)

    run_virtual(boot())


def test_every_fault_of_the_first_file_strikes(tmp_path: Path) -> None:
    (block,) = (block for block in blocks(PAGE.read_text("utf-8")) if block.file == "faults.yaml")
    file = tmp_path / block.file
    file.write_text(block.text, encoding="utf-8")
    faults = [msgspec.structs.replace(placed.fault, at_s=0.0) for placed in load_faults(file, MAX2D)]
    run_with_sockets(strike(MAX2D, faults, tmp_path / "simulated.sock"))


async def strike(robot_profile: Profile, faults: Sequence[Fault], socket: Path, bus: str = "simulated") -> None:
    """Set faults before a robot boots, and wait until each has struck it once."""
    async with running_robot(robot_profile, bus=bus, socket=socket, booted=False, expect_errors=True) as robot:
        for fault in faults:
            await robot.call("simulation.fault", **msgspec.to_builtins(fault))
        set_faults = robot.app.faults
        assert set_faults is not None
        await robot.until(lambda: all(row["struck"] for row in set_faults.told()))


def robot_of(kind: str) -> Profile:
    return NXT if kind == "brick_lost" else MAX2D


def example(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Fault:
    """What the command line sends for the example of a kind."""
    backend = FakeBackend()
    with served(backend, tmp_path / "robot.sock") as server:
        monkeypatch.setenv("CANHELM_SOCKET", os.fspath(server.path))
        assert main(EXAMPLES[kind].split()[1:]) == 0
    method, sent, _ = backend.calls[-1]
    given = {key: value for key, value in validate(METHODS[method], dict(sent)).items() if value is not None}
    if given.get("part") == 3:
        given["part"] = NODE_3
    return msgspec.convert(given, Fault)
