"""The devices of a profile on one master."""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable

from canhelm.errors import CanhelmError
from drivers.canopen.boot import NodeBoot
from drivers.canopen.device import CanopenDevice
from drivers.canopen.master import Master
from drivers.contract import Accelerometer, Brake, Drive, NodeState, SteeringEncoder
from drivers.encoder.encoder import Cia406Encoder
from drivers.epos.accelerometer import AnalogAccelerometer
from drivers.epos.brake import EposBrake
from drivers.epos.drive import EposDrive
from drivers.epos.gateway_drive import GatewayDrive
from profiles.schema import DriveConfig, Profile

LOGGER = logging.getLogger("canhelm")


class Devices:
    """Every drive, encoder and brake of a profile, each node with its boot-up.

    Args:
        master: the master of their bus.
        profile: the robot.

    Attributes:
        drives, encoders, brakes: by their names in the profile.
        accelerometer: None where the profile has none.
        by_node: drives and encoders by node id.
    """

    def __init__(self, master: Master, profile: Profile) -> None:
        drives = {name: _drive(master, name, config) for name, config in profile.drives.items()}
        encoders = {name: Cia406Encoder(master, name, config) for name, config in profile.encoders.items()}
        self.drives: dict[str, Drive] = dict(drives)
        self.encoders: dict[str, SteeringEncoder] = dict(encoders)
        self.brakes: dict[str, Brake] = {
            name: EposBrake(name, config, drives[config.drive]) for name, config in profile.brakes.items()
        }
        sensor = profile.accelerometer
        self.accelerometer: Accelerometer | None = (
            None if sensor is None else AnalogAccelerometer(sensor, drives[sensor.drive])
        )
        self.by_node: dict[int, CanopenDevice] = {
            device.node: device for device in (*drives.values(), *encoders.values())
        }
        self._boots = [NodeBoot(master, device) for device in self.by_node.values()]

    @property
    def on_reading(self) -> Callable[[int], None] | None:
        """Called with the node id after each cyclic reading of a node."""
        return next((device.on_reading for device in self.by_node.values()), None)

    @on_reading.setter
    def on_reading(self, callback: Callable[[int], None] | None) -> None:
        for device in self.by_node.values():
            device.on_reading = callback

    def start(self) -> None:
        """Start the boot-up of every node, on the running loop."""
        for boot in self._boots:
            boot.start()

    async def close(self) -> None:
        """Engage the brakes, end life guarding where drives are off, and end the boot-ups."""
        for brake in self.brakes.values():
            if self.drives[brake.drive].node_state is NodeState.READY:
                await _as_far_as_possible(brake.engage)
        for device in self.by_node.values():
            if device.node_state is NodeState.READY:
                await _as_far_as_possible(device.before_close)
        for boot in self._boots:
            await boot.close()


def _drive(master: Master, name: str, config: DriveConfig) -> EposDrive:
    if config.mode == "expiring_position":
        return GatewayDrive(master, name, config)
    return EposDrive(master, name, config)


async def _as_far_as_possible(closing: Callable[[], Awaitable[None]]) -> None:
    """A node that is gone or refuses cannot be left in better order, and must not keep the others from it."""
    try:
        await closing()
    except CanhelmError as error:
        LOGGER.warning("on closing: %s", error)
