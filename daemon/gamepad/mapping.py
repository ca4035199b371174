"""From the sticks of a pad to the parameters of ``drive.set``. Pure: numbers in, numbers out."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Positions = Callable[[str], float]
"""Where an axis is, from -1 to 1, by its name."""
Commands = dict[str, float]
"""Values by their commands: speed, sideways, yaw_rate, steering, direction."""
PLAIN = {"yaw_rate": "yaw_rate_deg_s", "steering": "steering_deg", "direction": "direction_deg"}
"""Commands that are parameters of ``drive.set`` by another name."""


@dataclass(frozen=True, slots=True)
class Stick:
    """One command and the axis that gives it.

    Attributes:
        axis: its name.
        sign: 1: growing values of the axis give more.
        dead_zone: share of the way around the middle that gives nothing.
        exponent: 1: in proportion; more: finer near the middle.
        least, full: value at the one and at the other end of the way.
        unit: of the value.
    """

    axis: str
    sign: int
    dead_zone: float
    exponent: float
    least: float
    full: float
    unit: str

    def rests(self, position: float) -> bool:
        """Whether the axis is within the dead zone."""
        return abs(position) <= self.dead_zone

    def value(self, position: float) -> float:
        """What the axis commands at a position from -1 to 1: nothing in the dead zone, from there on without a jump."""
        if self.rests(position):
            return 0.0
        share = math.pow((abs(position) - self.dead_zone) / (1.0 - self.dead_zone), self.exponent)
        return share * (self.full if position * self.sign > 0 else self.least)


@dataclass(frozen=True, slots=True)
class Buttons:
    """Names of the buttons; None where there is none."""

    dead_man: str
    stop: str | None
    emergency_stop: str | None


class Mapping:
    """A robot's mapping, as ``drive.gamepad`` tells it.

    Args:
        told: the method's result.

    Attributes:
        sticks: by their commands.
        buttons: which ones there are.
        silence_s: time without an event after which a pad that drives counts as lost; None for ever.
        rest_s: time in which the robot is at rest.
    """

    def __init__(self, told: dict[str, Any]) -> None:
        self.sticks = {command: Stick(**stick) for command, stick in told["sticks"].items()}
        self.buttons = Buttons(**told["buttons"])
        self.silence_s: float | None = told["silence_s"]
        self.rest_s: float = told["rest_s"]
        self._taken: Commands = {command: 0.0 for command in told["taken_at_rest"] if command in self.sticks}
        self._rolling = False

    def neutral(self, position: Positions) -> bool:
        """Whether no stick commands anything."""
        return all(stick.rests(position(stick.axis)) for stick in self.sticks.values())

    def commands(self, position: Positions) -> Commands:
        """What the sticks command now.

        On a robot that stands to steer, direction and steering are those of the moment at which the speed's stick last
        left its middle.
        """
        now = {command: stick.value(position(stick.axis)) for command, stick in self.sticks.items()}
        before, self._rolling = self._rolling, bool(now.get("speed"))
        if self._rolling and not before:
            self._taken = {command: now[command] for command in self._taken}
        return now | self._taken

    def parameters(self, commands: Commands) -> dict[str, float]:
        """The parameters of ``drive.set``; sideways and forward together are a direction, no faster than either."""
        speed = commands.get("speed", 0.0)
        parameters = {name: commands[command] for command, name in PLAIN.items() if command in commands}
        if "sideways" in commands:
            sideways = commands["sideways"]
            fastest = max(stick.full for command, stick in self.sticks.items() if command in ("speed", "sideways"))
            parameters["direction_deg"] = math.degrees(math.atan2(sideways, speed))
            speed = min(math.hypot(speed, sideways), fastest)
        return {"speed_m_s": speed, **parameters}

    def legend(self) -> str:
        """What sticks and stop buttons do, for people."""
        sticks = ", ".join(f"{stick.axis} {command}" for command, stick in self.sticks.items())
        does = ((self.buttons.stop, "stops"), (self.buttons.emergency_stop, "is the emergency stop"))
        stops = ", ".join(f"{button} {what}" for button, what in does if button)
        return f"{sticks}; {stops or 'no button stops'}"

    def words(self, commands: Commands) -> str:
        """The commands for people."""
        return ", ".join(f"{command} {value:.2f} {self.sticks[command].unit}" for command, value in commands.items())
