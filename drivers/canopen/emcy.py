"""Emergency messages (CiA 301 7.2.7): pure bytes."""

from __future__ import annotations

import struct

EMCY_COB_ID = 0x080
"""Plus node id."""

_EMCY = struct.Struct("<HB5s")


def parse_emcy(data: bytes) -> tuple[int, int, bytes] | None:
    """Code, error register and the maker's 5 bytes; None where the length is wrong."""
    return _EMCY.unpack(data) if len(data) == _EMCY.size else None
