"""Any bytes between an NXT brick and its host, on either side: the brick answers again, the host connects again."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from hypothesis import given
from hypothesis import strategies as st

from daemon.runtime.clock import run_virtual
from drivers.nxt.brick import Brick, OnLost
from drivers.nxt.line import Port
from drivers.nxt.telegrams import make_frame, make_reply, make_request
from drivers.simulated.nxt import SimulatedNxt
from drivers.simulated.nxt_link import SimulatedLink
from vcan_tests.drivers.test_nxt_telegrams import REPLY_EXAMPLES, REQUEST_EXAMPLES
from vcan_tests.fuzz.mutation import damaged
from vcan_tests.fuzz.pieces import make_pieces, parse_pieces
from vcan_tests.fuzz.target import Target, few

PAUSE_S = 0.05
RECOVERY_S = 60.0
MOST_PIECES = 12
REQUESTS = tuple(make_frame(make_request(content, reply)) for _, content, reply in REQUEST_EXAMPLES)
REPLIES = tuple(make_frame(make_reply(reply)) for _, reply in REPLY_EXAMPLES)


def talk(frames: tuple[bytes, ...]) -> st.SearchStrategy[bytes]:
    """Whole telegrams, damaged ones, telegrams of any content in a right frame, and noise."""
    framed = st.binary(max_size=64).map(make_frame)
    piece = st.sampled_from(frames) | damaged(frames) | framed | st.binary(max_size=80)
    return st.lists(piece, min_size=1, max_size=MOST_PIECES).map(make_pieces)


async def serves(brick: Brick) -> None:
    """The host finds the brick, asks it, and lets go of it."""
    async with asyncio.timeout(RECOVERY_S):
        await brick.wait_ready()
        assert await brick.read_battery() > 0
        await brick.close()


# -- the brick hears anything -----------------------------------------------------------------------------------------


def attempt_brick(content: bytes) -> None:
    run_virtual(disturbed_brick(parse_pieces(content)))


async def disturbed_brick(pieces: list[bytes]) -> None:
    twin = SimulatedNxt()
    for piece in pieces:
        twin.cable.write(piece)
        await asyncio.sleep(PAUSE_S)
    brick = Brick("brick", SimulatedLink(twin).connect)
    brick.start()
    await serves(brick)


BRICK = Target("nxt-brick", talk(REQUESTS), attempt_brick)


@few(30)
@given(BRICK.inputs)
def test_a_brick_that_heard_anything_serves_its_next_host(content: bytes) -> None:
    BRICK.check(content)


# -- the host hears anything ------------------------------------------------------------------------------------------


class Mumbler:
    """A port behind which somebody says a piece to each thing that the host says, and at last nothing."""

    def __init__(self, pieces: list[bytes]) -> None:
        self.host: Callable[[bytes, float], None] | None = None
        self._pieces = pieces

    def write(self, data: bytes) -> None:
        if self._pieces:
            asyncio.get_running_loop().call_later(PAUSE_S, self._speak, self._pieces.pop(0))

    def _speak(self, data: bytes) -> None:
        if self.host is not None:
            self.host(data, asyncio.get_running_loop().time())

    def close(self) -> None:
        self.host = None


def attempt_host(content: bytes) -> None:
    run_virtual(disturbed_host(parse_pieces(content)))


async def disturbed_host(pieces: list[bytes]) -> None:
    link, said = SimulatedLink(SimulatedNxt()), asyncio.Event()

    def connect(on_lost: OnLost) -> Port:
        if pieces:
            return Mumbler(pieces)
        said.set()
        return link.connect(on_lost)

    brick = Brick("brick", connect)
    brick.start()
    await said.wait()
    await serves(brick)


HOST = Target("nxt-host", talk(REPLIES), attempt_host)


@few(30)
@given(HOST.inputs)
def test_a_host_that_heard_anything_finds_the_real_brick(content: bytes) -> None:
    HOST.check(content)
