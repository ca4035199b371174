"""LSS master (CiA 305): node ids and bit rates of devices that are set over the bus, found by their identity."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable
from enum import IntEnum
from typing import NamedTuple

from canhelm.errors import DeviceFault, NodeAbsent, Refused, UsageError
from drivers.canopen.counters import CanopenCounters

REQUEST_COB_ID = 0x7E5
ANSWER_COB_ID = 0x7E4
UNCONFIGURED = 0xFF
"""Node id of a device that was given none: it keeps silent and takes part in the fast scan."""
BIT_TIMINGS = {
    1_000_000: 0, 800_000: 1, 500_000: 2, 250_000: 3, 125_000: 4, 50_000: 6, 20_000: 7, 10_000: 8,
}  # fmt: skip
"""Index of each bit rate in bit timing table 0 (CiA 305, 6.3.2)."""

_CONFIRM = 0x80
"""In place of the bit number of a fast scan: is there anybody?"""
_NUMBER = struct.Struct("<BI3x")
_FAST_SCAN = struct.Struct("<BIBBB")
_DELAY = struct.Struct("<BH5x")
_ANSWER_LENGTH = 8


class LssCommand(IntEnum):
    """Byte 0 of an LSS frame; inquiries and selections of the other identity numbers follow one by one."""

    SWITCH_GLOBAL = 0x04
    SET_NODE_ID = 0x11
    SET_BIT_TIMING = 0x13
    ACTIVATE_BIT_TIMING = 0x15
    STORE = 0x17
    SELECT = 0x40
    SELECTED = 0x44
    FOUND = 0x4F
    FAST_SCAN = 0x51
    INQUIRE = 0x5A
    INQUIRE_NODE_ID = 0x5E


class Identity(NamedTuple):
    """What tells one device from all others: object 0x1018, sub-indices 1 to 4."""

    vendor: int
    product: int
    revision: int
    serial: int

    def __str__(self) -> str:
        return ":".join(f"0x{number:X}" for number in self)


def parse_identity(text: str) -> Identity | None:
    """The identity that a person wrote as ``VENDOR:PRODUCT:REVISION:SERIAL``; None where the text is none."""
    try:
        numbers = [int(part, 0) for part in text.split(":")]
    except ValueError:
        return None
    return Identity(*numbers) if len(numbers) == 4 and all(0 <= n < 2**32 for n in numbers) else None


def make_switch_global(configuration: bool) -> bytes:
    """All devices into configuration, or back to waiting; nobody answers."""
    return bytes((LssCommand.SWITCH_GLOBAL, configuration)).ljust(8, b"\0")


def make_select(identity: Identity) -> list[bytes]:
    """The four frames that take the one device of this identity into configuration."""
    return [_NUMBER.pack(LssCommand.SELECT + part, number) for part, number in enumerate(identity)]


def make_inquire(part: int) -> bytes:
    """Ask for one number of the identity: 0 vendor, 1 product, 2 revision, 3 serial."""
    return _NUMBER.pack(LssCommand.INQUIRE + part, 0)


def make_inquire_node_id() -> bytes:
    """Ask for the node id."""
    return _NUMBER.pack(LssCommand.INQUIRE_NODE_ID, 0)


def make_set_node_id(node: int) -> bytes:
    """Give the device a node id, 1 to 127, or take it away with :data:`UNCONFIGURED`."""
    return _NUMBER.pack(LssCommand.SET_NODE_ID, node)


def make_set_bit_timing(bit_rate: int) -> bytes:
    """Give the device a bit rate of :data:`BIT_TIMINGS`. Raises KeyError for any other."""
    return _NUMBER.pack(LssCommand.SET_BIT_TIMING, BIT_TIMINGS[bit_rate] << 8)


def make_activate(delay_ms: int) -> bytes:
    """Let the new bit rate count: silence for this long, the change, silence once more; nobody answers."""
    return _DELAY.pack(LssCommand.ACTIVATE_BIT_TIMING, delay_ms)


def make_store() -> bytes:
    """Keep node id and bit rate for the next power-up."""
    return _NUMBER.pack(LssCommand.STORE, 0)


def make_fast_scan(number: int, bit: int, part: int, following: int) -> bytes:
    """Is there an unconfigured device whose identity number agrees with this one down to a bit?

    Args:
        number: what is known of the number so far.
        bit: lowest bit to compare, 31 to 0; 0x80: all unconfigured devices answer and begin anew.
        part: which number, 0 to 3.
        following: the number that devices which agree are to compare next.
    """
    return _FAST_SCAN.pack(LssCommand.FAST_SCAN, number, bit, part, following)


def parse_answer(data: bytes) -> tuple[int, int] | None:
    """Command and the number after it, of an LSS slave's answer; None where the length is wrong."""
    return _NUMBER.unpack(data) if len(data) == _ANSWER_LENGTH else None


class LssMaster:
    """Asks LSS slaves, one request at a time.

    Args:
        send: puts a frame on the bus: COB-ID, data, deadline.
        timeout_s: how long an answer may take.
        counters: where dropped answers are counted.
    """

    def __init__(self, send: Callable[[int, bytes, float], None], timeout_s: float, counters: CanopenCounters) -> None:
        self._send = send
        self._timeout_s = timeout_s
        self._counters = counters
        self._turn = asyncio.Lock()
        self._expected = 0
        self._waiter: asyncio.Future[int] | None = None

    def receive(self, can_id: int, data: bytes, timestamp: float) -> None:
        """Take a frame from the slaves' COB-ID."""
        answer = parse_answer(data)
        if answer is None:
            self._counters.malformed += 1
        elif self._waiter is None or self._waiter.done() or answer[0] != self._expected:
            self._counters.late_answers += 1
        else:
            self._waiter.set_result(answer[1])

    async def _ask(self, requests: list[bytes], expected: int, timeout_s: float) -> int | None:
        """Send frames and wait for the answer to the last one; None where there is none."""
        loop = asyncio.get_running_loop()
        async with self._turn:
            self._expected, self._waiter = expected, loop.create_future()
            try:
                async with asyncio.timeout(timeout_s):
                    for request in requests:
                        self._post(request)
                    return await self._waiter
            except TimeoutError:
                return None
            finally:
                self._waiter = None

    def _post(self, request: bytes) -> None:
        self._send(REQUEST_COB_ID, request, asyncio.get_running_loop().time() + self._timeout_s)

    async def _inquire(self, request: bytes) -> int:
        answer = await self._ask([request], request[0], self._timeout_s)
        if answer is None:
            raise NodeAbsent(
                "no LSS device in configuration answers",
                remedy="select one by its identity first; drives of the EPOS 24/5 series have no LSS",
            )
        return answer

    # --- services ------------------------------------------------------------------------------------------------

    def switch_global(self, configuration: bool) -> None:
        """All devices into configuration, which is only for a bus with one LSS device, or back to waiting."""
        self._post(make_switch_global(configuration))

    async def select(self, identity: Identity) -> None:
        """Take one device into configuration. Raises NodeAbsent where none has this identity."""
        if await self._ask(make_select(identity), LssCommand.SELECTED, self._timeout_s) is None:
            raise NodeAbsent(
                f"no LSS device has the identity {identity}",
                remedy="compare it with the type plate, or with 0x1018; `canhelm nodes find` finds a device without id",
            )

    async def inquire_identity(self) -> Identity:
        """The identity of the device in configuration. Raises NodeAbsent."""
        return Identity(*[await self._inquire(make_inquire(part)) for part in range(4)])

    async def inquire_node_id(self) -> int:
        """The node id of the device in configuration, :data:`UNCONFIGURED` for none. Raises NodeAbsent."""
        return await self._inquire(make_inquire_node_id()) & 0xFF

    async def set_node_id(self, node: int) -> None:
        """Give the device in configuration a node id; it counts after a reset of its communication.

        Raises:
            UsageError: no node id.
            NodeAbsent, Refused: the device is silent or does not take it.
        """
        if not (1 <= node <= 127 or node == UNCONFIGURED):
            raise UsageError(f"{node} is no node id", value=node, limit="1 to 127, or 255", remedy="give 1 to 127")
        self._check(await self._inquire(make_set_node_id(node)), f"node id {node}")

    async def set_bit_rate(self, bit_rate: int) -> None:
        """Give the device in configuration a bit rate; it counts after :meth:`activate` or the next power-up.

        Raises:
            UsageError: CiA 305 has no such bit rate.
            NodeAbsent, Refused: the device is silent or does not take it.
        """
        if bit_rate not in BIT_TIMINGS:
            known = ", ".join(str(rate) for rate in BIT_TIMINGS)
            raise UsageError(f"{bit_rate} bit/s is no bit rate of CiA 305", value=bit_rate, remedy=f"give {known}")
        self._check(await self._inquire(make_set_bit_timing(bit_rate)), f"bit rate {bit_rate} bit/s")

    def activate(self, delay_ms: int) -> None:
        """Let new bit rates count in every device in configuration; the interface has to change in the same time."""
        self._post(make_activate(delay_ms))

    async def store(self) -> None:
        """Keep what was set. Raises NodeAbsent, Refused, or DeviceFault where the device's memory fails."""
        code = await self._inquire(make_store()) & 0xFF
        if code == 2:
            raise DeviceFault("the device cannot write its memory", value=code, remedy="have the device replaced")
        self._check(code, "storing")

    def _check(self, answer: int, what: str) -> None:
        code = answer & 0xFF
        if code:
            raise Refused(
                f"the device does not take {what} (LSS error {code}, maker's error {answer >> 8 & 0xFF})",
                value=code,
                remedy="see the device's manual for the values that it supports",
            )

    # --- fast scan -----------------------------------------------------------------------------------------------

    async def find(self, answer_time_s: float = 0.02) -> Identity | None:
        """Find one unconfigured device by halving (CiA 305, fast scan) and take it into configuration.

        Args:
            answer_time_s: how long devices may take to answer each of the 133 questions; all of it is waited for.

        Returns:
            Its identity; None where no device is without a node id.

        Raises:
            DeviceFault: the answers contradict each other.
        """
        if not await self._agree(0, _CONFIRM, 0, 0, answer_time_s):
            return None
        return Identity(*[await self._find_number(part, answer_time_s) for part in range(4)])

    async def _find_number(self, part: int, answer_time_s: float) -> int:
        number = 0
        for bit in range(31, -1, -1):
            if not await self._agree(number, bit, part, part, answer_time_s):
                number |= 1 << bit
        if not await self._agree(number, 0, part, (part + 1) % 4, answer_time_s):
            raise DeviceFault(
                f"nobody confirms identity number {part + 1} (0x{number:X}) of the fast scan",
                value=number,
                remedy="allow more time for answers; look for disturbances on the bus",
            )
        return number

    async def _agree(self, number: int, bit: int, part: int, following: int, answer_time_s: float) -> bool:
        """Ask, and hear everybody out: the second answer to this question must not be taken for one to the next."""
        loop = asyncio.get_running_loop()
        end_s = loop.time() + answer_time_s
        answer = await self._ask([make_fast_scan(number, bit, part, following)], LssCommand.FOUND, answer_time_s)
        await asyncio.sleep(end_s - loop.time())
        return answer is not None
