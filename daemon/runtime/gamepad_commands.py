"""What a client with a gamepad has to know: the profile's mapping, in numbers of this vehicle."""

from __future__ import annotations

from typing import Any, Final

from canhelm.errors import Refused
from daemon.runtime.handlers import Handler, Params
from daemon.runtime.vehicle import Stick, Vehicle
from profiles.gamepad import GamepadConfig, StickConfig

UNITS: Final = {"speed": "m/s", "sideways": "m/s", "yaw_rate": "deg/s", "steering": "deg", "direction": "deg"}
REST_S: Final = 0.4
"""What a vehicle takes to rest beyond its ramp: a set-point's way to the wheels, and tyres that swing out."""


class GamepadCommands:
    """The method ``drive.gamepad``.

    Args:
        vehicle: that is driven.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        self._vehicle = vehicle
        self.handlers: dict[str, Handler] = {"drive.gamepad": self._gamepad}

    async def _gamepad(self, params: Params, lease: str | None) -> dict[str, Any]:
        vehicle, config = self._vehicle, self._vehicle.profile.gamepad
        ranges = vehicle.sticks()
        if not ranges:
            raise Refused("no gamepad drives this vehicle", remedy="`canhelm motor velocity` turns one motor")
        return {
            "sticks": {command: told for command in ranges if (told := _stick(config, command, ranges[command]))},
            "buttons": {
                "dead_man": config.dead_man,
                "stop": config.stop,
                "emergency_stop": config.emergency_stop,
            },
            "taken_at_rest": ["direction", "steering"] if vehicle.steers_at_rest else [],
            "silence_s": config.silence_s,
            "rest_s": round(vehicle.ramp_s() + REST_S, 2),
        }


def _stick(config: GamepadConfig, command: str, ends: Stick) -> dict[str, Any] | None:
    """One command's stick; None where the profile has none for it."""
    stick: StickConfig | None = getattr(config, command)
    if stick is None:
        return None
    return {
        "axis": stick.axis,
        "sign": stick.sign,
        "dead_zone": stick.dead_zone,
        "exponent": stick.exponent,
        "least": round(stick.share * ends[0], 6),
        "full": round(stick.share * ends[1], 6),
        "unit": UNITS[command],
    }
