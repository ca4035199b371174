"""What a profile says of NXT bricks, and of robots on two wheels."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from profiles.parts import Length, Name, NotNegative, Part, Positive, WheelRadius


class NxtMotorConfig(Part, frozen=True, kw_only=True):
    """One motor of a brick with its wheel."""

    output: Literal["A", "B", "C"]
    """The brick's port."""
    wheel_radius_m: WheelRadius
    direction: Literal[1, -1] = 1
    """1: positive power rolls the wheel forward."""
    play_deg: NotNegative = 0.0
    """Play between motor and wheel, at the wheel."""
    max_speed_m_s: Positive
    """Limit of the wheel's speed; the brick regulates up to 1000 degrees a second."""
    quick_stop_m_s2: Positive
    """How quickly the motor stops that the brick shorts."""


class BrickConfig(Part, frozen=True, kw_only=True):
    """One NXT brick: how it is reached, what is plugged into it, when its battery is low."""

    port: Annotated[str, Meta(pattern="^(serial:/.+|usb)$")] = "serial:/dev/rfcomm0"
    """serial:DEVICE for Bluetooth, usb for the cable."""
    motors: Annotated[dict[Name, NxtMotorConfig], Meta(min_length=1)]
    """By name, in the order in which they are read."""
    battery_warning_v: Positive = 6.9
    """Voltage below which the brick's status says so."""
    battery_refusal_v: Positive = 6.3
    """Voltage below which nothing begins to move."""


class DifferentialGeometry(Part, frozen=True, kw_only=True, tag_field="type", tag="differential"):
    """A robot on two driven wheels on one axis (Siegwart and Nourbakhsh, Autonomous Mobile Robots, 3.2)."""

    type: ClassVar[str] = "differential"
    half_track_m: Length
    """l: from the middle of the axis to each wheel."""
    wheels: tuple[str, str]
    """Names of the drives, or motors, of the wheels: right, left."""
