"""Conversations with the CiA 309-3 gateway of a whole simulated robot, on virtual time."""

from __future__ import annotations

import asyncio
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daemon.api.gateway309_session import Session
from daemon.runtime.clock import run_virtual
from drivers.simulated.encoder import SimulatedEncoder
from vcan_tests.daemon.gateway309_rules import ANSWER, Heard, cocomm
from vcan_tests.daemon.test_gateway309_text import LINES
from vcan_tests.robot import Robot, running_robot

GUIDE = Path(__file__).parents[2] / "docs" / "cia309.md"


def transcript() -> str:
    """The conversation in the documentation."""
    found = re.search(r"```309\n(.*?)```", GUIDE.read_text(), re.DOTALL)
    assert found is not None
    return found[1]


def dialogue(text: str) -> list[tuple[str, str]]:
    """Requests and answers of a transcript, in turns."""
    return re.findall(r"^> (.*)\n<(?: (.*))?$", text, re.MULTILINE)


async def ask(session: Session, line: str) -> str:
    """One request and its answer, which must be well formed and must say the same to cocomm."""
    answer = await session.answer(line.encode("latin-1"))
    found = ANSWER.fullmatch(answer)
    assert found is not None, answer
    heard = cocomm(answer)
    if found["value"] is not None:
        assert heard == Heard("value", found["value"].decode("latin-1"))
    elif answer != b"\r\n":
        assert heard.kind == ("error" if b"ERROR" in answer else "ok")
    return answer.decode("latin-1").removesuffix("\r\n")


async def test_the_conversation_in_the_documentation_happens_word_for_word() -> None:
    async with running_robot(expect_errors=True) as robot:
        session = Session(robot.app.supervisor)
        for request, answer in dialogue(transcript()):
            if request.endswith("led"):
                await robot.until(lambda: robot.state == "idle")
            assert await ask(session, request) == answer


# -- time-outs --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("request_line", "timeout_s"), [("[2] 99 r 0x1000 0", 0.05), ("[2] 99 w 0x1017 0 u16 1", 0.05)]
)
async def test_the_client_says_how_long_an_answer_may_take(request_line: str, timeout_s: float) -> None:
    async with running_robot(booted=False) as robot:
        session, loop = Session(robot.app.supervisor), asyncio.get_running_loop()
        await ask(session, f"[1] set sdo_timeout {timeout_s * 1e3:.0f}")
        begin = loop.time()
        assert "ERROR:0x05040000" in await ask(session, request_line)
        assert loop.time() - begin == pytest.approx(timeout_s)


async def test_half_a_second_is_what_an_answer_may_take_unless_said_otherwise() -> None:
    async with running_robot(booted=False) as robot:
        begin = asyncio.get_running_loop().time()
        await ask(Session(robot.app.supervisor), "[1] 99 r 0x1000 0")
        assert asyncio.get_running_loop().time() - begin == pytest.approx(0.5)


# -- what may not be done ---------------------------------------------------------------------------------------------

WRITING = [
    "[1] 99 w 0x1017 0 u16 1000",
    "[1] 4 w 0x6083 0 u32 2000",
    "[1] 0 start",
    "[1] 4 stop",
    "[1] 4 preop",
    "[1] 4 reset node",
    "[1] 4 reset comm",
    "[1] lss_switch_glob 1",
    "[1] lss_get_node",
    "[1] lss_allnodes",
]


@pytest.mark.parametrize("line", WRITING)
async def test_a_client_that_may_only_read_puts_nothing_else_on_the_bus(line: str) -> None:
    async with running_robot(booted=False, powered=False) as robot:
        robot.app.cycle.stop()
        sent = robot.app.bus.counters.sent
        answer = await ask(Session(robot.app.supervisor, "it only reads"), line)
        assert (answer, robot.app.bus.counters.sent) == ("[1] ERROR:100 #it only reads", sent)


async def test_nothing_is_written_while_a_drive_is_enabled() -> None:
    async with running_robot() as robot:
        session = Session(robot.app.supervisor)
        await robot.call("motor.enable", node=4)
        for line in (line for line in WRITING if " 99 " not in line):
            assert (await ask(session, line)).startswith("[1] ERROR:102 #a drive is enabled")
        assert await ask(session, "[2] 4 r 0x1008 0 vs") == '[2] "EPOS"'
        await robot.call("motor.disable", node=4)


FORBIDDEN = {
    "[1] 4 w 0x6040 0 u16 0x000F": "is switched by the daemon alone",
    "[1] 4 w 0x6040 0 u16 0x001F": "is switched by the daemon alone",
    "[1] 4 w 0x100C 0 u16 0": "is guarded as its profile says",
    "[1] 5 w 0x100D 0 u8 0": "is guarded as its profile says",
}


@pytest.mark.parametrize("line", FORBIDDEN)
async def test_an_interlock_cannot_be_got_round_by_objects(line: str) -> None:
    async with running_robot(booted=False, powered=False) as robot:
        answer = await ask(Session(robot.app.supervisor), line)
        assert answer.startswith("[1] ERROR:102 #")
        assert FORBIDDEN[line] in answer


@pytest.mark.parametrize("bus", ["simulated", "rs232"])
@pytest.mark.parametrize("value", ["u8 5", "u64 5", "hex 05 00 00"])
async def test_a_value_of_another_length_than_its_object_is_refused_on_any_wire(bus: str, value: str) -> None:
    async with running_robot(bus=bus) as robot:
        session = Session(robot.app.supervisor)
        before = await ask(session, "[1] 4 r 0x6083 0 u32")
        assert (await ask(session, f"[2] 4 w 0x6083 0 {value}")).startswith("[2] ERROR:0x06070010 #")
        assert await ask(session, "[1] 4 r 0x6083 0 u32") == before


async def test_a_text_and_the_objects_of_strangers_have_any_length() -> None:
    async with running_robot() as robot:
        session = Session(robot.app.supervisor)
        assert (await ask(session, '[1] 4 w 0x1008 0 vs "A"')).startswith("[1] ERROR:0x06010002")
        assert (await ask(session, "[2] 99 w 0x6083 0 u8 5")).startswith("[2] ERROR:0x05040000")


async def test_outputs_that_work_a_brake_are_not_switched_by_objects() -> None:
    async with running_robot(booted=False, powered=False) as robot:
        brake = next(iter(robot.app.devices.brakes.values()))
        node = robot.app.devices.drives[brake.drive].node
        answer = await ask(Session(robot.app.supervisor), f"[1] {node} w 0x2078 1 u16 0xFFFF")
        assert f"works the {brake.name} brake" in answer


async def test_the_emergency_stop_stays_latched_whatever_a_client_writes() -> None:
    async with running_robot(expect_errors=True) as robot:
        await robot.call("estop")
        session = Session(robot.app.supervisor)
        for value in (0x80, 0x06, 0x07, 0x0F):
            await ask(session, f"[1] 4 w 0x6040 0 u16 {value}")
        assert (robot.state, robot.app.supervisor.anything_enabled) == ("estop", False)


# -- LSS --------------------------------------------------------------------------------------------------------------


def without_node_id(robot: Robot) -> SimulatedEncoder:
    """The front encoder, as it comes from its maker."""
    encoder = robot.network.node("front")
    assert isinstance(encoder, SimulatedEncoder)
    encoder.lss.stored = 0xFF
    return encoder


async def power_on(robot: Robot) -> None:
    """Let everything boot that has a node id."""
    robot.network.power_on("all")
    await robot.until(lambda: robot.app.devices.by_node[5].node_state == "ready")


async def test_a_new_encoder_is_found_named_and_used() -> None:
    async with running_robot(booted=False, powered=False) as robot:
        encoder = without_node_id(robot)
        await power_on(robot)
        session = Session(robot.app.supervisor)
        identity = " ".join(f"0x{number:08X}" for number in encoder.lss.identity)
        conversation = f"""\
> [1] _lss_fastscan 20
< [1] {identity}
> [2] lss_get_node
< [2] 0xFF
> [3] lss_set_node 6
< [3] OK
> [4] lss_store
< [4] OK
> [5] lss_inquire_addr 0
< [5] {identity.split()[0]}
> [6] lss_switch_glob 0
< [6] OK
"""
        for request, answer in dialogue(conversation):
            assert await ask(session, request) == answer
        await robot.until(lambda: robot.state == "idle")


async def test_all_new_devices_get_node_ids_that_are_free() -> None:
    async with running_robot(booted=False, powered=False) as robot:
        encoder = without_node_id(robot)
        await power_on(robot)
        answer = await ask(Session(robot.app.supervisor), "[1] lss_allnodes 20 1 1")
        assert answer.splitlines()[-1] == "# devices that were given a node id: 1"
        assert encoder.lss.stored == 7


async def test_a_device_is_chosen_by_its_identity() -> None:
    async with running_robot(expect_errors=True) as robot:
        encoder = robot.network.node("front")
        assert isinstance(encoder, SimulatedEncoder)
        session = Session(robot.app.supervisor)
        await ask(session, "[1] 6 preop")
        assert await ask(session, "[1] lss_switch_sel " + " ".join(map(str, encoder.lss.identity))) == "[1] OK"
        assert await ask(session, "[2] lss_get_node") == "[2] 0x06"
        assert (await ask(session, "[3] lss_conf_bitrate 0 9")).startswith("[3] ERROR:503")
        assert (await ask(session, "[4] lss_set_node 0")).startswith("[4] ERROR:502")
        assert await ask(session, "[5] lss_conf_bitrate 0 2") == "[5] OK"
        assert (await ask(session, "[6] lss_switch_sel 1 2 3 4")).startswith("[6] ERROR:103")


async def test_a_search_by_pattern_is_not_supported() -> None:
    async with running_robot(booted=False, powered=False) as robot:
        answer = await ask(Session(robot.app.supervisor), "[1] lss_allnodes 20 7 1 2 1 0 0 0 0 0 0")
        assert answer.startswith("[1] ERROR:100")


REFUSALS = [(1, 0, 504), (0xFF, 7, 501), (2, 0, 505)]


@pytest.mark.parametrize(("code", "makers_code", "number"), REFUSALS)
async def test_why_a_device_does_not_store_is_told_by_the_number(
    code: int, makers_code: int, number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with running_robot(booted=False, powered=False) as robot:
        encoder = without_node_id(robot)
        monkeypatch.setitem(encoder.lss._services, 0x17, lambda request: (code, makers_code))
        await power_on(robot)
        session = Session(robot.app.supervisor)
        await ask(session, "[1] lss_switch_glob 1")
        assert (await ask(session, "[2] lss_store")).startswith(f"[2] ERROR:{number} #")


# -- the rest ---------------------------------------------------------------------------------------------------------


async def test_each_client_has_a_default_node_of_its_own() -> None:
    async with running_robot() as robot:
        one, other = Session(robot.app.supervisor), Session(robot.app.supervisor)
        await ask(one, "[1] set node 4")
        await ask(other, "[1] set node 5")
        assert (await ask(one, "[2] r 0x1000 0 x32"), await ask(other, "[2] r 0x1000 0 x32")) == (
            "[2] 0x00200192",
            "[2] 0x00010196",
        )


@pytest.mark.parametrize("line", ["help", "help datatype", "help lss", "log", "led", "info version"])
async def test_texts_about_the_gateway_need_no_node(line: str) -> None:
    async with running_robot() as robot:
        assert (await ask(Session(robot.app.supervisor), f"[1] {line}")).startswith("[1] ")


@settings(max_examples=15, deadline=None)
@given(st.lists(LINES, max_size=20))
def test_any_line_gets_a_well_formed_answer(lines: list[bytes]) -> None:
    async def scenario() -> None:
        async with running_robot(booted=False, powered=False, expect_errors=True) as robot:
            session = Session(robot.app.supervisor)
            await session.answer(b"[1] set sdo_timeout 1")
            for line in lines:
                assert ANSWER.fullmatch(await session.answer(line)), line

    run_virtual(scenario())
