"""The method for gamepads, as data (see :mod:`daemon.api.methods`)."""

from __future__ import annotations

from typing import Final

from daemon.api.parameters import Method, Role

GAMEPAD_METHODS: Final = (
    Method(
        "drive.gamepad",
        "How a gamepad drives this vehicle by drive.set: the profile's sticks and buttons, and what they stand for.",
        (),
        "sticks, buttons, taken_at_rest, silence_s, rest_s",
        Role.WATCH,
    ),
)
