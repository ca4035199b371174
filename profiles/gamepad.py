"""What a profile says of driving by a gamepad: sticks, buttons, and when a silent pad counts as lost.

Names are the kernel's. Left out, they are those of a pad that keeps to its gamepad protocol (Linux,
Documentation/input/gamepad.rst): left stick ABS_X, ABS_Y, right stick ABS_RX, ABS_RY, upper shoulder buttons BTN_TL,
BTN_TR.
"""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from profiles.gamepad_codes import AXES, BUTTONS
from profiles.parts import Part, Positive

AxisName = Annotated[str, Meta(pattern=f"^({'|'.join(AXES)})$")]
ButtonName = Annotated[str, Meta(pattern=f"^({'|'.join(BUTTONS)})$")]


class StickConfig(Part, frozen=True, kw_only=True):
    """One command, and the axis that gives it; it has to spring back to its middle."""

    axis: AxisName
    """Name of the axis, as `canhelm drive joystick --list` prints it."""
    sign: Literal[1, -1] = -1
    """1: the axis' growing values are forward, left or counter-clockwise. Pads count to the right and to the person."""
    dead_zone: Annotated[float, Meta(ge=0, le=0.9)] = 0.12
    """Share of the way around the middle that counts as nothing."""
    exponent: Annotated[float, Meta(ge=0.2, le=5)] = 1.6
    """1: in proportion; more: finer near the middle."""
    share: Annotated[float, Meta(gt=0, le=1)] = 1.0
    """Of the robot's own limit, what the end of the way stands for."""


class GamepadConfig(Part, frozen=True, kw_only=True):
    """Which stick gives which command, and which buttons there are; commands that the vehicle has not are idle."""

    speed: StickConfig | None = StickConfig(axis="ABS_Y")
    """Forward and backward."""
    sideways: StickConfig | None = StickConfig(axis="ABS_X")
    """To the left and to the right, on omni-wheels."""
    yaw_rate: StickConfig | None = StickConfig(axis="ABS_RX")
    """Turning while driving or on the spot."""
    steering: StickConfig | None = StickConfig(axis="ABS_RX")
    """Steering angle of the wheels."""
    direction: StickConfig | None = StickConfig(axis="ABS_X")
    """Of all wheels of a paired-steer robot, taken when it begins to drive."""
    dead_man: ButtonName = "BTN_TL"
    """Held as long as the robot shall drive."""
    stop: ButtonName | None = "BTN_SOUTH"
    """Stops everything by the quick-stop ramps."""
    emergency_stop: ButtonName | None = "BTN_EAST"
    """Latches the emergency stop."""
    silence_s: Positive | None = 5.0
    """While it drives, a pad without any event for so long counts as lost: no thumb is so still. None: it may be."""
