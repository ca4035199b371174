"""What goes into a law and what comes out: frozen numbers in SI.

Frames and signs: x forward, y left, angles counter-clockwise positive, wheel speed positive when it rolls forward.
Order of wheels and pairs is the profile's (for paired steering: rear right, rear left, front left, front right; and
rear, front).
"""

from __future__ import annotations

import msgspec


class Measurement(msgspec.Struct, frozen=True, gc=False):
    """One cycle's readings.

    Attributes:
        time_s: time of the readings.
        wheel_speed_m_s: rim speed of each wheel.
        wheel_travel_m: distance that each wheel has rolled.
        heading_rad: heading of each wheel pair.
        brake_engaged: True for each steering brake that is certainly engaged.
        brake_released: True for each steering brake that is certainly released (both False while it moves).
        acceleration_m_s2: of the accelerometer's place along its axes; None without a reading.
        motor_current_a: of each wheel's motor, positive where it drives forward.
    """

    time_s: float
    wheel_speed_m_s: tuple[float, ...]
    wheel_travel_m: tuple[float, ...]
    heading_rad: tuple[float, ...] = ()
    brake_engaged: tuple[bool, ...] = ()
    brake_released: tuple[bool, ...] = ()
    acceleration_m_s2: tuple[float, float] | None = None
    motor_current_a: tuple[float, ...] = ()


class Command(msgspec.Struct, frozen=True, gc=False):
    """What a law asks for in one cycle.

    Attributes:
        wheel_speed_m_s: rim speed of each wheel.
        release_brake: for each steering brake, whether it shall be released.
    """

    wheel_speed_m_s: tuple[float, ...]
    release_brake: tuple[bool, ...] = ()
