"""What a CAN bus can carry: bits of a control cycle, and the rate at which they fill the wire.

A frame of n data bytes has 34 + 8 n bits from start of frame to CRC, in which a stuff bit follows at the most every
four after the first, and 13 bits without stuffing, the intermission included (Bosch CAN 2.0 part A, 3.1 and 5).
"""

from __future__ import annotations

from typing import NamedTuple

READING_BYTES, TARGET_BYTES, ANGLE_BYTES = 8, 6, 4
"""TPDO1 and RPDO1 of a drive, TPDO1 of an encoder."""
_STUFFED_BITS, _UNSTUFFED_BITS = 34, 13


class Bits(NamedTuple):
    """Bits on the wire: without any stuffing, and with as much as there can be."""

    least: int
    most: int


def frame_bits(data_bytes: int) -> Bits:
    """Bits of a data frame with an 11-bit identifier, intermission included."""
    stuffed = _STUFFED_BITS + 8 * data_bytes
    return Bits(stuffed + _UNSTUFFED_BITS, stuffed + (stuffed - 1) // 4 + _UNSTUFFED_BITS)


def cycle_bits(drives: int, encoders: int = 0) -> Bits:
    """Bits of a control cycle: SYNC, the readings of all nodes, the targets of all drives; without guarding."""
    counts = {0: 1, READING_BYTES: drives, TARGET_BYTES: drives, ANGLE_BYTES: encoders}
    frames = [frame_bits(size) for size, count in counts.items() for _ in range(count)]
    return Bits(sum(frame.least for frame in frames), sum(frame.most for frame in frames))
