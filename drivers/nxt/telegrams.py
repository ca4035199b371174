"""Telegrams of the NXT as pure bytes, and the frame that they have over Bluetooth.

A request is its kind (0x00 direct, 0x01 system; plus 0x80 when no reply is wanted), its opcode and its parameters; a
reply is 0x02, the opcode, a status and, when that is 0, parameters. Values are little-endian. Over Bluetooth a length
of two bytes precedes each telegram. Source: LEGO MINDSTORMS NXT Bluetooth Developer Kit, Appendix 1 and 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from drivers.nxt.codes import NO_REPLY, OK, Kind
from drivers.nxt.layout import Telegram
from drivers.nxt.replies import BY_OPCODE
from drivers.nxt.requests import REQUESTS

MAX_TELEGRAM: Final = 64
"""Longest telegram, without its length."""


@dataclass(frozen=True, slots=True)
class Request:
    """A request as it came over the wire."""

    content: Telegram
    wants_reply: bool


@dataclass(frozen=True, slots=True)
class Reply:
    """A reply as it came over the wire.

    Attributes:
        opcode: of the request.
        status: 0 when all went well.
        content: what was asked for; None where there is nothing to tell, or something went wrong.
    """

    opcode: int
    status: int = OK
    content: Telegram | None = None


def make_request(content: Telegram, reply: bool = True) -> bytes:
    """The telegram of a request.

    Args:
        content: one of :mod:`drivers.nxt.requests`.
        reply: whether the brick is to reply.

    Raises:
        ValueError: a value that its field cannot hold.
    """
    return bytes((content.KIND | (0 if reply else NO_REPLY), content.OPCODE)) + content.pack()


def parse_request(telegram: bytes) -> Request | str:
    """The request in a telegram, or the reason why it is none."""
    if not 2 <= len(telegram) <= MAX_TELEGRAM:
        return f"a telegram has 2 to {MAX_TELEGRAM} bytes, not {len(telegram)}"
    known = REQUESTS.get((telegram[0] & ~NO_REPLY, telegram[1]))
    if known is None:
        return f"unknown request {telegram[:2].hex(' ')}"
    try:
        return Request(known.unpack(telegram[2:]), not telegram[0] & NO_REPLY)
    except ValueError as error:
        return str(error)


def make_reply(reply: Reply) -> bytes:
    """The telegram of a reply. Raises ValueError for a value that its field cannot hold."""
    content = b"" if reply.content is None else reply.content.pack()
    return bytes((Kind.REPLY, reply.opcode, reply.status)) + content


def parse_reply(telegram: bytes) -> Reply | str:
    """The reply in a telegram, or the reason why it is none.

    With a status other than 0 the parameters mean nothing and are not looked at.
    """
    if not 3 <= len(telegram) <= MAX_TELEGRAM:
        return f"a reply has 3 to {MAX_TELEGRAM} bytes, not {len(telegram)}"
    kind, opcode, status = telegram[:3]
    if kind != Kind.REPLY:
        return f"{telegram[:1].hex()} does not begin a reply"
    known = BY_OPCODE.get(opcode)
    if status != OK or known is None:
        return Reply(opcode, status)
    try:
        return Reply(opcode, status, known.unpack(telegram[3:]))
    except ValueError as error:
        return str(error)


def make_frame(telegram: bytes) -> bytes:
    """A telegram as it goes over Bluetooth, its length before it."""
    return len(telegram).to_bytes(2, "little") + telegram


class Unframer:
    """Takes the telegrams out of a stream of bytes.

    Attributes:
        dropped: bytes that were thrown away because no telegram is as long as they said.
    """

    def __init__(self) -> None:
        self.dropped = 0
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """Telegrams that are complete with ``data``. After a length that cannot be, all that has come is dropped."""
        buffer, found = self._buffer, []
        buffer += data
        while len(buffer) >= 2:
            size = int.from_bytes(buffer[:2], "little")
            if not 2 <= size <= MAX_TELEGRAM:
                self.dropped += len(buffer)
                buffer.clear()
            elif len(buffer) < 2 + size:
                break
            else:
                found.append(bytes(buffer[2 : 2 + size]))
                del buffer[: 2 + size]
        return found
