"""In what form a bus is recorded continuously: as candump's text, or as MCAP."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import msgspec

from daemon.runs.mcap_bytes import TAIL, frame_content, make_head, make_messages
from daemon.runs.mcap_file import FRAMES_CHANNEL, schema_of
from drivers.bus.candump import make_lines


@dataclass(frozen=True, slots=True)
class LogForm:
    """One form.

    Attributes:
        name: begins the names of files in a folder.
        suffix: ends them.
        make: makes of packed frames, an epoch and the interface's name what is written.
        head: begins each file.
        tail: ends each file. It stands there after each piece, and the next one is written over it.
    """

    name: str
    suffix: str
    make: Callable[[bytearray, float, str], bytes]
    head: bytes = b""
    tail: bytes = b""


CANDUMP: Final = LogForm("candump", ".log", make_lines)
_SCHEMA = msgspec.json.encode(schema_of(frame_content("can0", 0x181, b"")))
MCAP: Final = LogForm("frames", ".mcap", make_messages, make_head(FRAMES_CHANNEL, _SCHEMA), TAIL)
FORMS: Final = {"candump": CANDUMP, "mcap": MCAP}
"""By the names that people give them."""
