"""The bytes of an MCAP file that holds the frames of a bus: one channel, neither chunks nor an index.

MCAP format specification (mcap.dev/spec): a file is a magic number, records, and the magic number again; a record is
its opcode, the length of its content, and that.
"""

from __future__ import annotations

import struct
from typing import Any, Final

import msgspec

from canhelm import __version__
from drivers.bus.candump import unpack_frames
from drivers.bus.contract import ID_MASK, RTR_FLAG

MAGIC: Final = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _DATA_END = 0x01, 0x02, 0x03, 0x04, 0x05, 0x0F
_PREFIX = struct.Struct("<BQ")
_LENGTH, _NUMBER = struct.Struct("<I"), struct.Struct("<H")
_TIMES = struct.Struct("<HIQQ")
"""Of a message: channel, number in sequence, time of its record, time of its publication."""
_ONLY = 1
"""Number of the only schema, and of the only channel."""


def _record(opcode: int, content: bytes) -> bytes:
    return _PREFIX.pack(opcode, len(content)) + content


def _text(text: str) -> bytes:
    return _LENGTH.pack(len(text.encode())) + text.encode()


def make_head(topic: str, schema: bytes) -> bytes:
    """What begins a file.

    Args:
        topic: of the channel.
        schema: of its messages, JSON Schema.
    """
    number, nothing = _NUMBER.pack(_ONLY), _LENGTH.pack(0)
    told = _text(f"canhelm.{topic.removeprefix('/')}") + _text("jsonschema") + _LENGTH.pack(len(schema)) + schema
    channel = number + _text(topic) + _text("json") + nothing
    header = _text("") + _text(f"canhelm {__version__}")
    records = ((_HEADER, header), (_SCHEMA, number + told), (_CHANNEL, number + channel))
    return MAGIC + b"".join(_record(opcode, content) for opcode, content in records)


def make_message(time_s: float, content: bytes) -> bytes:
    """One message, at a time of day."""
    time_ns = round(time_s * 1e9)
    return _record(_MESSAGE, _TIMES.pack(_ONLY, 0, time_ns, time_ns) + content)


TAIL: Final = _record(_DATA_END, _LENGTH.pack(0)) + _record(_FOOTER, bytes(20)) + MAGIC
"""What ends a file: no checksums, no summary."""


def frame_content(interface: str, can_id: int, data: bytes) -> dict[str, Any]:
    """A frame as its message tells it; ``can_id`` with RTR_FLAG for a remote frame."""
    number = can_id & ID_MASK
    return {
        "interface": interface,
        "id": number,
        "id_hex": f"{number:03X}",
        "remote": bool(can_id & RTR_FLAG),
        "data_hex": data.hex().upper(),
    }


def make_messages(packed: bytes | bytearray, epoch_s: float, interface: str) -> bytes:
    """The messages of packed frames one after the other; the arguments are those of ``candump.make_lines``."""
    encode = msgspec.json.Encoder().encode
    return b"".join(
        make_message(epoch_s + timestamp_s, encode(frame_content(interface, can_id, data)))
        for timestamp_s, can_id, data in unpack_frames(packed)
    )
