"""How long a classic CAN base frame occupies the wire, to the bit, and how busy a wire is.

A frame is SOF, 11 identifier bits, RTR, IDE, r0, 4 DLC bits, the data and a 15-bit CRC, in which a complementary bit
follows each run of five equal ones, then 10 bits without stuffing (delimiters, acknowledge, end of frame) and 3 bits of
intermission (Bosch CAN 2.0 part A, 3.1 and 5). Whole bytes go through tables: one step of the CRC and one of the
stuffing a byte.
"""

from __future__ import annotations

from collections import deque
from functools import lru_cache

from drivers.bus.contract import ID_MASK, RTR_FLAG

INTERMISSION_BITS = 3
_UNSTUFFED_BITS = 10 + INTERMISSION_BITS
_HEADER_BITS = 19
_CRC_BITS = 15
_CRC_MASK = 0x7FFF
_CRC_POLYNOMIAL = 0x4599


def _crc_table() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        crc = byte << 7
        for _ in range(8):
            crc = (crc << 1) ^ (_CRC_POLYNOMIAL if crc & 0x4000 else 0)
            crc &= _CRC_MASK
        table.append(crc)
    return tuple(table)


def _stuff(state: int, value: int, width: int) -> int:
    """Send ``width`` bits of ``value``: the next state above bit 8, the number of stuff bits below.

    The state is the level of the last bit on the wire times 4, plus the number of equal bits so far less one (0 to 3);
    a fifth equal bit is followed at once by its stuff bit, which begins a new run.
    """
    stuffed = 0
    for shift in range(width - 1, -1, -1):
        bit = value >> shift & 1
        if state >> 2 != bit:
            state = bit << 2
        elif state & 3 < 3:
            state += 1
        else:
            state = (bit ^ 1) << 2
            stuffed += 1
    return state << 8 | stuffed


_CRC_OF_BYTE = _crc_table()
_STUFF_8 = tuple(_stuff(state, byte, 8) for state in range(8) for byte in range(256))
_STUFF_7 = tuple(_stuff(index >> 8, index & 0x7F, 7) for index in range(2048))


@lru_cache(maxsize=4096)
def _header(can_id: int, length: int) -> tuple[int, int]:
    """State of the stuffing (with its count) and of the CRC after the 19 bits from SOF to DLC."""
    if can_id & ~(ID_MASK | RTR_FLAG) or length > 8:
        raise ValueError(f"no classic base frame: identifier 0x{can_id:X}, {length} data bytes")
    remote = 1 if can_id & RTR_FLAG else 0
    bits = (can_id & ID_MASK) << 7 | remote << 6 | length
    crc = 0
    for shift in (16, 8, 0):  # leading zeros leave a CRC that starts at zero as it is
        crc = (crc << 8 & _CRC_MASK) ^ _CRC_OF_BYTE[crc >> 7 ^ bits >> shift & 0xFF]
    return _stuff(0, bits, _HEADER_BITS - 1), crc


@lru_cache(maxsize=4096)
def frame_bits(can_id: int, data: bytes) -> int:
    """Bits that one frame occupies on the wire, stuff bits and intermission included.

    Args:
        can_id: 11-bit identifier, with RTR_FLAG for a remote frame.
        data: 0 to 8 bytes; a remote frame sends none of them, only their number.

    Raises:
        ValueError: an identifier or a length that a classic base frame cannot have.
    """
    state, crc = _header(can_id, len(data))
    if can_id & RTR_FLAG:
        data = b""
    counts = state  # in its low byte, which no 8 data bytes make overflow
    for byte in data:
        crc = (crc << 8 & _CRC_MASK) ^ _CRC_OF_BYTE[crc >> 7 ^ byte]
        state = _STUFF_8[state & 0xF00 | byte]
        counts += state
    state = _STUFF_8[state & 0xF00 | crc >> 7]
    counts += state + _STUFF_7[state & 0xF00 | crc & 0x7F]
    return _HEADER_BITS + 8 * len(data) + _CRC_BITS + _UNSTUFFED_BITS + (counts & 0xFF)


class LoadMeter:
    """Share of the last second that a wire was busy.

    Attributes:
        total_bits: bits sent since the beginning, intermissions included.
    """

    __slots__ = ("_bit_rate", "_recent", "_recent_bits", "total_bits")

    def __init__(self, bit_rate: int) -> None:
        self.total_bits = 0
        self._bit_rate = bit_rate
        self._recent: deque[tuple[float, int]] = deque()
        self._recent_bits = 0

    def add(self, end_s: float, bits: int) -> None:
        """Count a frame of ``bits`` that ended at ``end_s``; frames come in the order of their times."""
        self.total_bits += bits
        self._recent_bits += bits
        recent = self._recent
        recent.append((end_s, bits))
        before_s = end_s - 1.0
        while recent[0][0] <= before_s:  # as _forget does, without a call a frame
            self._recent_bits -= recent.popleft()[1]

    def load(self, now_s: float) -> float:
        """Load over the second before ``now_s``, 0 to 1."""
        self._forget(now_s - 1.0)
        return min(1.0, self._recent_bits / self._bit_rate)

    def _forget(self, before_s: float) -> None:
        recent = self._recent
        while recent and recent[0][0] <= before_s:
            self._recent_bits -= recent.popleft()[1]
