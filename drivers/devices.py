"""The devices of a profile on one master."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Mapping

from canhelm.errors import CanhelmError
from drivers.canopen.boot import NodeBoot
from drivers.canopen.device import CanopenDevice
from drivers.canopen.master import Master
from drivers.contract import Accelerometer, Brake, Device, Drive, NodeState, SteeringEncoder
from drivers.encoder.encoder import Cia406Encoder
from drivers.epos.accelerometer import AnalogAccelerometer
from drivers.epos.brake import EposBrake
from drivers.epos.drive import EposDrive
from drivers.epos.gateway_drive import GatewayDrive
from drivers.nxt.brick import Brick, BrickSettings, OnLost
from drivers.nxt.line import Port
from drivers.nxt.motors import MotorCycle, NxtDrive
from profiles.bricks import BrickConfig
from profiles.schema import DriveConfig, Profile

LOGGER = logging.getLogger("canhelm")
END_GUARDING_S = 4.0
"""How long the end of life guarding may take for all nodes; an absent one takes 2.5 s over a serial line."""
Connect = Callable[[OnLost], Port]
"""Makes the connection to a brick; raises BusOff where there is none to be had."""


class Devices:
    """Every drive, encoder, brake and brick of a profile, each node with its boot-up.

    Args:
        master: the master of their bus.
        profile: the robot.
        connect: the ways to its bricks, by their names.

    Attributes:
        drives, encoders, brakes, bricks: by their names in the profile; motors of bricks are drives, too.
        accelerometer: None where the profile has none.
        by_node: drives and encoders by node id.
        all: those, and then the motors of bricks.
    """

    def __init__(self, master: Master, profile: Profile, connect: Mapping[str, Connect] = {}) -> None:
        drives = {name: _drive(master, name, config) for name, config in profile.drives.items()}
        encoders = {name: Cia406Encoder(master, name, config) for name, config in profile.encoders.items()}
        self.bricks = {name: _brick(name, config, connect[name]) for name, config in profile.bricks.items()}
        motors = {
            name: NxtDrive(name, self.bricks[brick], config, brick)
            for brick, owner in profile.bricks.items()
            for name, config in owner.motors.items()
        }
        self.drives: dict[str, Drive] = {**drives, **motors}
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
        self.all: tuple[Device, ...] = (*self.by_node.values(), *motors.values())
        self._boots = [NodeBoot(master, device) for device in self.by_node.values()]
        self._motor_cycles = [
            MotorCycle(brick, [motor for motor in motors.values() if motor.brick is brick])
            for brick in self.bricks.values()
        ]

    @property
    def on_reading(self) -> Callable[[int], None] | None:
        """Called with the node id after each cyclic reading of a node."""
        return next((device.on_reading for device in self.by_node.values()), None)

    @on_reading.setter
    def on_reading(self, callback: Callable[[int], None] | None) -> None:
        for device in self.by_node.values():
            device.on_reading = callback

    def start(self) -> None:
        """Start the boot-up of every node and the connections to the bricks, on the running loop."""
        for boot in self._boots:
            boot.start()
        for motors in self._motor_cycles:
            motors.start()

    async def close(self) -> None:
        """Engage the brakes, end life guarding where drives are off, and end boot-ups and connections."""
        for brake in self.brakes.values():
            if self.drives[brake.drive].node_state is NodeState.READY:
                await _as_far_as_possible(brake.engage)
        await self._end_guarding()
        for boot in self._boots:
            await boot.close()
        for motors in self._motor_cycles:
            await motors.close()

    async def _end_guarding(self) -> None:
        """Nodes that do not answer in time keep it: who ends the daemon is not to wait for each of them."""
        ready = [device for device in self.by_node.values() if device.node_state is NodeState.READY]
        try:
            async with asyncio.timeout(END_GUARDING_S):
                while ready:
                    await _as_far_as_possible(ready[0].before_close)
                    del ready[0]
        except TimeoutError:
            names = ", ".join(device.name for device in ready)
            LOGGER.warning("on closing: %s not told within %g s that the master ends", names, END_GUARDING_S)


def _drive(master: Master, name: str, config: DriveConfig) -> EposDrive:
    if config.mode == "expiring_position":
        return GatewayDrive(master, name, config)
    return EposDrive(master, name, config)


def _brick(name: str, config: BrickConfig, connect: Connect) -> Brick:
    settings = BrickSettings(warn_v=config.battery_warning_v, refuse_v=config.battery_refusal_v)
    return Brick(name, connect, settings)


async def _as_far_as_possible(closing: Callable[[], Awaitable[None]]) -> None:
    """A node that is gone or refuses cannot be left in better order, and must not keep the others from it."""
    try:
        await closing()
    except CanhelmError as error:
        LOGGER.warning("on closing: %s", error)
