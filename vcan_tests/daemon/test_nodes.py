"""``nodes.*`` and ``lss.*`` on the simulated robot: scan, memory of nodes, node ids and bit rates."""

from __future__ import annotations

import asyncio
import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

from canhelm.errors import Interlock, NodeAbsent, Refused, UsageError
from daemon.cli.main import main
from drivers.simulated.encoder import SimulatedEncoder
from drivers.simulated.lss_slave import UNCONFIGURED
from profiles.loader import load
from profiles.schema import EncoderConfig
from vcan_tests.daemon.fake_backend import FakeBackend, served
from vcan_tests.robot import Robot, running_robot

MAX2D = load("max2d").profile


def new_encoder(robot: Robot, node: int) -> SimulatedEncoder:
    """One more encoder on the bus, without power."""
    assert robot.app.medium is not None
    config = EncoderConfig(node=node, counts_per_turn=4096)
    return SimulatedEncoder(robot.app.medium.port(f"new {node}"), config, "front", robot.network.world, 0.05)


async def scan(robot: Robot, **params: Any) -> dict[int, dict[str, Any]]:
    found = await robot.call("nodes.scan", **({"first": 1, "last": 127} | params))
    return {entry["node"]: entry for entry in found["nodes"]}


def identity_of(encoder: SimulatedEncoder) -> str:
    return ":".join(hex(number) for number in encoder.lss.identity)


# --- scan ------------------------------------------------------------------------------------------------------------


async def test_a_healthy_robot_is_listed_without_a_remark() -> None:
    async with running_robot() as robot:
        nodes = await scan(robot)
        shown = {node: (entry["name"], entry["device"], entry["firmware"]) for node, entry in nodes.items()}
        assert shown[3] == ("front_left", "EPOS", "2011")
        assert shown[6] == ("front", "CiA 406 encoder", "0000")
        assert sorted(nodes) == [1, 2, 3, 4, 5, 6]
        assert {entry["state"] for entry in nodes.values()} == {"operational"}
        assert {entry["remark"] for entry in nodes.values()} == {""}


async def test_a_scan_while_driving_stops_nothing() -> None:
    async with running_robot() as robot:
        driving = asyncio.ensure_future(
            robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.2, duration_s=4.0, wait=True)
        )
        await asyncio.sleep(1.0)
        assert len(await scan(robot)) == 6
        await driving
        assert robot.state == "idle"


async def test_a_node_without_power_is_absent_and_named() -> None:
    async with running_robot(expect_errors=True) as robot:
        robot.network.power_off(3)
        await asyncio.sleep(1.0)
        entry = (await scan(robot, first=3, last=3))[3]
        assert (entry["name"], entry["state"]) == ("front_left", "absent")
        assert "check its power" in entry["remark"]


async def test_a_node_that_no_profile_knows_is_listed_as_such() -> None:
    async with running_robot() as robot:
        new_encoder(robot, 40).power_on()
        await asyncio.sleep(0.1)
        entry = (await scan(robot))[40]
        assert (entry["state"], entry["remark"]) == ("pre-operational", "not in the profile")


async def test_two_nodes_with_one_id_are_named_with_what_to_do() -> None:
    async with running_robot(expect_errors=True) as robot:
        new_encoder(robot, 5).power_on()
        await asyncio.sleep(0.5)
        nodes = await scan(robot)
        assert [node for node, entry in nodes.items() if "two nodes have this id" in entry["remark"]] == [5]
        assert "canhelm nodes set-id" in nodes[5]["remark"]


async def test_a_stopped_node_is_listed_with_the_command_that_wakes_it() -> None:
    async with running_robot(expect_errors=True) as robot:
        await robot.call("nmt", command="stop", node=6)
        await asyncio.sleep(0.1)
        entry = (await scan(robot, first=6, last=6))[6]
        assert (entry["state"], "canhelm nmt preop 6" in entry["remark"]) == ("stopped", True)


async def test_a_node_with_another_bit_rate_shows_by_error_frames() -> None:
    async with running_robot(expect_errors=True) as robot:
        node = robot.network.node(6)
        robot.network.power_off(6)
        node.port.set_bit_rate(500_000)
        robot.network.power_on(6)
        await asyncio.sleep(1.0)
        found = await robot.call("nodes.scan", first=1, last=127)
        assert {entry["node"]: entry["state"] for entry in found["nodes"]}[6] == "absent"
        assert "node 6 (front) keeps silent: probably set to another bit rate than" in found["remarks"][0]


async def test_a_healthy_bus_gets_no_remark() -> None:
    async with running_robot() as robot:
        assert (await robot.call("nodes.scan", first=1, last=10))["remarks"] == []


async def test_over_rs232_a_scan_at_rest_lists_the_nodes_and_loses_none() -> None:
    async with running_robot(bus="rs232") as robot:
        nodes = await scan(robot, first=1, last=8)
        assert {node: entry["device"] for node, entry in nodes.items()} == {
            **dict.fromkeys((1, 2, 3, 4), "EPOS"),
            **dict.fromkeys((5, 6), "CiA 406 encoder"),
        }
        assert {entry["remark"] for entry in nodes.values()} == {""}
        assert robot.state == "idle"


async def test_over_rs232_a_scan_says_whom_it_asks() -> None:
    async with running_robot(bus="rs232") as robot:
        found = await robot.call("nodes.scan", first=1, last=2)
        assert found["remarks"] == ["over RS-232 only nodes of the profile are asked: 1, 2, 3, 4, 5, 6"]


@pytest.mark.parametrize(
    ("bus", "first", "last", "told"),
    [("simulated", 3, 2, "behind"), ("rs232", 3, 2, "behind"), ("rs232", 7, 127, "only")],
)
async def test_a_scan_that_could_ask_nobody_is_wrong_usage(bus: str, first: int, last: int, told: str) -> None:
    async with running_robot(bus=bus, booted=False) as robot:
        with pytest.raises(UsageError, match=told):
            await robot.call("nodes.scan", first=first, last=last)


async def test_over_rs232_a_scan_of_six_nodes_takes_no_longer_than_documented() -> None:
    async with running_robot(bus="rs232") as robot:
        begin = asyncio.get_running_loop().time()
        await scan(robot)
        assert asyncio.get_running_loop().time() - begin < 20.0


async def test_over_rs232_a_scan_is_refused_while_a_drive_is_enabled() -> None:
    async with running_robot(bus="rs232") as robot:
        await robot.call("motor.enable", node=1)
        with pytest.raises(Interlock):
            await scan(robot, first=1, last=8)
        await robot.call("motor.disable", node=1)


# --- memory of nodes -------------------------------------------------------------------------------------------------


async def test_stored_parameters_outlive_the_power_and_restored_ones_do_not() -> None:
    async with running_robot() as robot:
        encoder = new_encoder(robot, 40)
        encoder.power_on()
        await asyncio.sleep(0.1)
        encoder.dictionary.values[0x6200, 0] = 20
        await robot.call("nodes.store", node=40, confirm=True)
        encoder.power_off()
        encoder.power_on()
        await asyncio.sleep(0.1)
        assert encoder.dictionary.number("cyclic_timer") == 20
        await robot.call("nodes.restore", node=40, confirm=True)
        encoder.power_off()
        encoder.power_on()
        assert encoder.dictionary.number("cyclic_timer") == 0


@pytest.mark.parametrize("node", [3, "front"])
async def test_a_node_of_the_vehicle_is_ready_again_after_it_has_stored(node: int | str) -> None:
    async with running_robot(expect_errors=True) as robot:
        await robot.call("nodes.store", node=node, confirm=True)
        await robot.until(lambda: all(str(d.node_state) == "ready" for d in robot.app.devices.by_node.values()))
        await robot.call("reset")
        assert robot.state == "idle"


@pytest.mark.parametrize("method", ["nodes.store", "nodes.restore"])
async def test_nothing_is_written_unless_somebody_agrees(method: str) -> None:
    async with running_robot() as robot:
        with pytest.raises(Refused, match="not confirmed"):
            await robot.call(method, node=3, confirm=False)


async def test_nothing_is_stored_while_a_drive_is_enabled() -> None:
    async with running_robot() as robot:
        await robot.call("motor.enable", node=1)
        with pytest.raises(Interlock):
            await robot.call("nodes.store", node=3, confirm=True)
        await robot.call("motor.disable", node=1)


# --- LSS -------------------------------------------------------------------------------------------------------------


async def test_a_new_encoder_is_found_given_an_id_and_seen_in_the_scan() -> None:
    async with running_robot() as robot:
        encoder = new_encoder(robot, 40)
        encoder.lss.stored = UNCONFIGURED
        encoder.power_on()
        await asyncio.sleep(0.1)
        assert 40 not in await scan(robot)
        found = await robot.call("lss.find")
        await robot.call("lss.set_node_id", device=found["identity"], node_id=41, confirm=True)
        assert (await scan(robot))[41]["device"] == "CiA 406 encoder"


async def test_an_encoder_with_an_id_gets_another_one_that_it_keeps() -> None:
    async with running_robot() as robot:
        encoder = new_encoder(robot, 40)
        encoder.power_on()
        await asyncio.sleep(0.1)
        await robot.call("lss.set_node_id", device="40", node_id=41, confirm=True)
        encoder.power_off()
        encoder.power_on()
        await asyncio.sleep(0.1)
        nodes = await scan(robot)
        assert (40 in nodes, 41 in nodes) == (False, True)


async def test_an_id_that_the_profile_does_not_have_is_told_with_what_to_change() -> None:
    async with running_robot(expect_errors=True) as robot:
        new_encoder(robot, 40).power_on()
        await asyncio.sleep(0.1)
        for device, whose in (("40", "a drive or an encoder"), ("front", "front")):
            told = await robot.call("lss.set_node_id", device=device, node_id=50 + len(whose), confirm=True)
            node = told["node"]
            assert told["note"] == (
                f"node {node} answers; the profile has no node {node}: write `node: {node}` there for {whose}, "
                "and start the daemon anew"
            )


async def test_a_node_id_that_is_taken_is_not_given() -> None:
    async with running_robot() as robot:
        with pytest.raises(Refused, match="node id 3 is taken"):
            await robot.call("lss.set_node_id", device="front", node_id=3, confirm=True)


async def test_dip_switches_that_give_a_drive_its_id_are_named() -> None:
    async with running_robot(expect_errors=True) as robot:
        with pytest.raises(Refused, match="DIP switches of node 3") as refusal:
            await robot.call("lss.set_node_id", device="front_left", node_id=40, confirm=True)
        assert "set them to 40" in str(refusal.value.remedy)
        await robot.until(lambda: robot.state == "idle")
        robot.network.drives["front_left"].dip_switches = 0
        robot.network.power_off(3)
        robot.network.power_on("front_left")
        await asyncio.sleep(0.3)
        assert robot.network.drives["front_left"].node_id == 1  # its memory is as before


async def test_a_drive_from_the_factory_gets_its_id_once_its_twin_is_off_the_bus() -> None:
    assert MAX2D.simulation is not None
    simulation = msgspec.structs.replace(MAX2D.simulation, factory=("front_left",))
    built = msgspec.structs.replace(MAX2D, simulation=simulation)
    async with running_robot(built=built, booted=False, expect_errors=True) as robot:
        await asyncio.sleep(2.0)
        set_id = {"device": "1", "node_id": 3, "confirm": True}
        with pytest.raises(Refused, match="two drives have node id 1"):
            await robot.call("lss.set_node_id", **set_id)
        await robot.call("simulation.power", node="rear_right", on=False)
        assert (await robot.call("lss.set_node_id", **set_id))["note"] == "node 3 answers"
        await robot.call("simulation.power", node="rear_right", on=True)
        await robot.call("simulation.power", node="front_left", on=False)
        await robot.call("simulation.power", node="front_left", on=True)
        await robot.until(lambda: "motor_type" in robot.app.devices.by_node[3].status_sentence)
        await robot.until(lambda: robot.app.devices.by_node[1].node_state == "ready")


async def test_where_nobody_is_without_an_id_nobody_is_found() -> None:
    async with running_robot() as robot:
        with pytest.raises(NodeAbsent, match="without a node id"):
            await robot.call("lss.find")


async def test_over_rs232_there_is_no_lss() -> None:
    async with running_robot(bus="rs232") as robot:
        with pytest.raises(Refused, match="RS-232"):
            await robot.call("lss.find")


async def test_a_stored_bit_rate_makes_a_stranger_of_the_encoder_after_the_next_power_up() -> None:
    async with running_robot() as robot:
        encoder = new_encoder(robot, 40)
        encoder.power_on()
        await asyncio.sleep(0.1)
        await robot.call("lss.set_bit_rate", device=identity_of(encoder), bit_rate=500_000, confirm=True)
        assert 40 in await scan(robot, first=40, last=40)
        encoder.power_off()
        encoder.power_on()
        await asyncio.sleep(0.1)
        assert 40 not in await scan(robot, first=40, last=40)


async def test_a_bit_rate_that_cia_305_does_not_have_is_refused() -> None:
    async with running_robot() as robot:
        encoder = new_encoder(robot, 40)
        encoder.power_on()
        await asyncio.sleep(0.1)
        with pytest.raises(UsageError):
            await robot.call("lss.set_bit_rate", device="40", bit_rate=100_000, confirm=True)
        await asyncio.sleep(0.01)
        assert not encoder.lss.configuring


# --- command line ----------------------------------------------------------------------------------------------------

ENTRY = {
    "node": 3,
    "name": "front_left",
    "device": "EPOS",
    "firmware": "2011",
    "state": "operational",
    "remark": "two nodes have this id",
}


class NodesBackend(FakeBackend):
    """Answers as a daemon with one node."""

    async def call(self, method: str, params: dict[str, Any], lease: str | None) -> dict[str, Any]:
        await super().call(method, {key: value for key, value in params.items() if key != "node"}, lease)
        return {"nodes": [ENTRY], "remarks": ["7 error frames"]} if method == "nodes.scan" else {"note": "done"}


@pytest.fixture
def backend(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[NodesBackend]:
    backend = NodesBackend()
    with served(backend, tmp_path / "robot.sock") as server:
        monkeypatch.setenv("CANHELM_SOCKET", os.fspath(server.path))
        yield backend


def test_a_scan_is_one_line_a_node_and_remarks_go_to_stderr(
    backend: NodesBackend, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["nodes", "scan"]) == 0
    out, err = capsys.readouterr()
    assert (json.loads(out), "7 error frames" in err) == (ENTRY, True)


def test_a_person_sees_a_table(backend: NodesBackend, capsys: pytest.CaptureFixture[str]) -> None:
    from rich.console import Console

    from daemon.cli.nodes import _table

    Console(width=120).print(_table([ENTRY]))
    assert "front_left" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("line", "method", "params"),
    [
        ("nodes store 3 --yes", "nodes.store", {"confirm": True}),
        ("nodes restore front --yes", "nodes.restore", {"confirm": True}),
        ("nodes find", "lss.find", {}),
        ("nodes set-id 127 5 --yes", "lss.set_node_id", {"device": "127", "node_id": 5, "confirm": True}),
        ("nodes set-id 0:1:2:0x3 5 --yes", "lss.set_node_id", {"device": "0:1:2:0x3", "node_id": 5, "confirm": True}),
        ("nodes set-bit-rate 5 500000 --yes", "lss.set_bit_rate", {"bit_rate": 500_000, "confirm": True}),
    ],
)
def test_each_command_calls_its_method(backend: NodesBackend, line: str, method: str, params: dict[str, Any]) -> None:
    assert main(line.split()) == 0
    called, sent, _ = backend.calls[-1]
    assert (called, sent | params) == (method, sent)


def test_without_a_person_nothing_is_changed_unless_told(backend: NodesBackend) -> None:
    assert main(["nodes", "store", "3"]) == 2
    assert backend.calls == []


@pytest.mark.parametrize(("answer", "calls"), [("y\n", 1), ("\n", 0), ("no\n", 0)])
def test_a_person_is_asked_before_anything_is_written(
    backend: NodesBackend, monkeypatch: pytest.MonkeyPatch, answer: str, calls: int
) -> None:
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True)
    monkeypatch.setattr(sys.stdin, "readline", lambda: answer)
    assert main(["nodes", "restore", "3"]) == 0
    assert len(backend.calls) == calls
