"""Any lines to the CiA 309-3 gateway of a running robot: each has a well-formed answer, and the robot still stops."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from daemon.api.gateway309_answers import EMPTY
from daemon.api.gateway309_session import Session
from daemon.runtime.clock import run_virtual
from vcan_tests.daemon.gateway309_rules import ANSWER
from vcan_tests.daemon.test_gateway309_text import LINES
from vcan_tests.fuzz.mutation import damaged, damaged_text
from vcan_tests.fuzz.target import Target, few
from vcan_tests.robot import running_robot

MOST_LINES = 12
PATIENCE = b"[1] set sdo_timeout 20"
USUAL = tuple(
    line.encode()
    for line in (
        "[1] 4 read 0x1000 0",
        "[1] 4 r 0x1018 1 u32",
        "[0x2] 3 r 0x6041 0 x16",
        "[3] 1 r 0x1008 0 vs",
        "[3] 6 r 0x1009 0 d",
        "[4] 4 write 0x6083 0 u32 1000",
        "[5] 4 w 0x6083 0 hex E8 03 00 00",
        '[5] 5 w 0x2000 0 vs "a ""quoted"" text"',
        "[5] 5 w 0x6000 0 i16 -5",
        "[5] 2 w 0x6060 0 r32 1.5e3",
        "[5] 2 w 0x6060 0 os aGVsbG8=",
        "[6] 0 start",
        "[6] 4 stop",
        "[6] 4 preop",
        "[6] 1 4 reset node",
        "[6] reset comm",
        "[7] set node 4",
        "[7] set network 1",
        "[7] set sdo_timeout 20",
        "[7] set sdo_block 1",
        "[8] info version",
        "[8] led",
        "[8] log",
        "[8] help lss",
        "[9] lss_switch_glob 1",
        "[9] lss_switch_sel 251 1 2 3",
        "[9] lss_set_node 7",
        "[9] lss_conf_bitrate 0 2",
        "[9] lss_activate_bitrate 10",
        "[9] lss_store",
        "[9] lss_inquire_addr 2",
        "[9] lss_get_node",
        "[9] _lss_fastscan 5",
        "[9] lss_allnodes 5 2 0 2 251 1 0 1 0 1 0",
        "# a comment",
    )
)


def lines() -> st.SearchStrategy[bytes]:
    """Requests, such with a word or a byte changed, and noise."""
    line = st.sampled_from(USUAL) | damaged_text(USUAL) | damaged(USUAL) | LINES
    return st.lists(line.map(lambda found: found.replace(b"\n", b" ")), min_size=1, max_size=MOST_LINES).map(b"\n".join)


def attempt(content: bytes) -> None:
    run_virtual(told(content.split(b"\n")))


async def told(requests: list[bytes]) -> None:
    async with running_robot(expect_errors=True) as robot:
        session = Session(robot.app.supervisor)
        await session.answer(PATIENCE)
        for line in requests:
            answer = await session.answer(line)
            assert answer == EMPTY or ANSWER.fullmatch(answer), answer
        assert (await robot.call("estop"))["state"] == "estop"


GATEWAY309 = Target("309", lines(), attempt)


@few(12)
@given(GATEWAY309.inputs)
def test_every_line_is_answered_in_the_gateways_own_form(content: bytes) -> None:
    GATEWAY309.check(content)
