"""A Bluetooth connection to the simulated brick inside this process."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from typing import Final

from canhelm.errors import BusOff
from drivers.nxt.codes import Output
from drivers.simulated.nxt import BLUETOOTH, USB, SimulatedNxt
from drivers.simulated.nxt_robot import NxtRobotConstants, SimulatedNxtRobot
from drivers.simulated.serial_wire import SerialCable
from profiles.bricks import DifferentialGeometry
from profiles.schema import Profile

MAX_NAME: Final = 14
"""Characters of a brick's name."""


class LinkEnd:
    """The host's end of one connection.

    Attributes:
        host: takes what the brick sends.
    """

    def __init__(self, cable: SerialCable) -> None:
        self._cable: SerialCable | None = cable

    @property
    def host(self) -> Callable[[bytes, float], None] | None:
        """Takes what the brick sends."""
        return None if self._cable is None else self._cable.host

    @host.setter
    def host(self, host: Callable[[bytes, float], None] | None) -> None:
        if self._cable is not None:
            self._cable.host = host

    def write(self, data: bytes) -> None:
        """Send bytes; closed, they are lost."""
        if self._cable is not None:
            self._cable.write(data)

    def close(self) -> None:
        """End the connection; what is under way to either side is lost."""
        if self._cable is not None:
            self._cable.host = None
            self._cable.to_host.clear()
            self._cable.to_device.clear()
            self._cable = None


class SimulatedLink:
    """Makes connections to one brick, and breaks them.

    Args:
        brick: the brick.

    Attributes:
        reachable: set it to False to let nobody connect.
    """

    def __init__(self, brick: SimulatedNxt) -> None:
        self.reachable = True
        self._brick = brick
        self._end: LinkEnd | None = None
        self._on_lost: Callable[[str], None] | None = None

    def connect(self, on_lost: Callable[[str], None]) -> LinkEnd:
        """A new connection. Raises BusOff where the brick is not reachable."""
        if not self.reachable:
            raise BusOff("no brick in reach", remedy="switch the brick on")
        self._end, self._on_lost = LinkEnd(self._brick.cable), on_lost
        return self._end

    def drop(self, reason: str = "out of reach") -> None:
        """Break the connection; the motors do what they were told last."""
        if self._end is not None and self._on_lost is not None:
            self._end.close()
            asyncio.get_running_loop().call_soon(self._on_lost, reason)
            self._end = None


class SimulatedBrick:
    """A brick of a profile, its connection, and the robot around it where it drives one.

    Args:
        brick: the brick.
        robot: what it drives; None for motors that only turn.

    Attributes:
        brick, robot: as given.
        link: makes connections to it.
    """

    def __init__(self, brick: SimulatedNxt, robot: SimulatedNxtRobot | None = None) -> None:
        self.brick = brick
        self.robot = robot
        self.link = SimulatedLink(brick)
        self.link.reachable = False

    def power_on(self) -> None:
        """Switch it on."""
        self.link.reachable = True

    def power_off(self) -> None:
        """Switch it off: its motors coast, the connection is gone."""
        self.link.reachable = False
        self.brick.switch_off()
        self.link.drop("it was switched off")

    async def close(self) -> None:
        """Let nothing be under way any more."""
        self.link.reachable = False
        self.brick.cable.to_host.clear()
        self.brick.cable.to_device.clear()


def simulated_brick(profile: Profile, name: str, seed: int) -> SimulatedBrick:
    """The brick of a profile by its name; over USB it is as fast as USB is."""
    config, vehicle = profile.bricks[name], profile.vehicle
    timing = USB if config.port == "usb" else BLUETOOTH
    wheels = vehicle.wheels if isinstance(vehicle, DifferentialGeometry) else ()
    motors = [config.motors[wheel] for wheel in wheels if wheel in config.motors]
    if not isinstance(vehicle, DifferentialGeometry) or len(motors) != len(wheels):
        return SimulatedBrick(SimulatedNxt(name[:MAX_NAME], timing=timing))
    right, left = motors
    constants = NxtRobotConstants(
        right.wheel_radius_m,
        vehicle.half_track_m,
        math.radians(right.play_deg),
        outputs=(Output[right.output], Output[left.output]),
        directions=(right.direction, left.direction),
    )
    robot = SimulatedNxtRobot(constants, seed, timing)
    return SimulatedBrick(robot.brick, robot)
