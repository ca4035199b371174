"""Power of an NXT motor: for a regulated speed, and for a move by an angle."""

from __future__ import annotations

import math
from typing import Final

FULL_SPEED_DEG_S: Final = 1000.0
"""Speed that the brick regulates to at power 100 (LEGO firmware)."""


def regulated_power(speed_rad_s: float) -> int:
    """The power at which the brick regulates to a speed; the least one where rounding would make none of it."""
    if speed_rad_s == 0:
        return 0
    power = round(100 * math.degrees(speed_rad_s) / FULL_SPEED_DEG_S)
    return max(-100, min(100, power)) or int(math.copysign(1, speed_rad_s))


def move_order(power: float, angle_deg: float) -> tuple[int, int]:
    """Power with the direction's sign, and the tacho limit, which has none. Raises ValueError."""
    if power == 0:
        raise ValueError(f"at power 0 a motor never turns {angle_deg} degrees")
    size = max(1, min(100, round(abs(power))))
    return (size if angle_deg > 0 else -size), abs(round(angle_deg))
