"""A robot's network in one process: drives, encoders and brakes of a profile on a simulated bus, and the physics."""

from __future__ import annotations

import asyncio
import logging
from functools import partial
from math import cos, radians, sin
from random import Random

import msgspec

from canhelm.errors import ConfigError
from drivers.simulated.ackermann import AckermannWorld
from drivers.simulated.angle_sensor import SimulatedAngleSensor
from drivers.simulated.body import BodyWorld
from drivers.simulated.brake import SimulatedBrake
from drivers.simulated.bus import SimulatedBus
from drivers.simulated.encoder import SimulatedEncoder
from drivers.simulated.epos import SimulatedEpos
from drivers.simulated.max2d import Max2dWorld
from drivers.simulated.node import SimulatedNode
from drivers.simulated.nxt_link import SimulatedBrick, simulated_brick
from drivers.simulated.omni import OmniWorld
from drivers.simulated.scanner import SimulatedScanner
from drivers.simulated.semitrailer import SemitrailerWorld
from drivers.simulated.stand import StandWorld
from profiles.bricks import DifferentialGeometry
from profiles.own_class import load_class
from profiles.own_vehicle import OwnGeometry
from profiles.schema import BrakeConfig, OmniGeometry, Profile
from profiles.sensors import SensorDefects
from profiles.steered import CarGeometry, SemitrailerGeometry

LOGGER = logging.getLogger("canhelm")
FACTORY_NODE = 1
"""Node id of a drive that nobody has set up."""
ALL_OFF = 0
"""Its DIP switches."""
_BOOT_DELAY_S = (0.05, 0.15)
"""Shortest and longest time from power-up to the boot-up message (assumed)."""
_WATCH_S = 0.01
"""Longest time that moving things are left unobserved."""


def make_world(profile: Profile, seed: int) -> BodyWorld:
    """The physics of a profile's vehicle. Raises ConfigError where it cannot be simulated."""
    if isinstance(profile.vehicle, OmniGeometry):
        return OmniWorld(profile, seed)
    if isinstance(profile.vehicle, CarGeometry):
        return AckermannWorld(profile, seed)
    if isinstance(profile.vehicle, SemitrailerGeometry):
        return SemitrailerWorld(profile, seed)
    if isinstance(profile.vehicle, OwnGeometry) and profile.vehicle.twin is not None:
        return _own_world(profile.vehicle.twin, profile, seed)
    if profile.vehicle is None or isinstance(profile.vehicle, DifferentialGeometry | OwnGeometry):
        return StandWorld(profile, profile.drives, seed)
    return Max2dWorld(profile, seed)


def _own_world(name: str, profile: Profile, seed: int) -> BodyWorld:
    """The twin that a profile names. Raises ConfigError where none can be made of its numbers."""
    try:
        world: BodyWorld = load_class(name)(profile, seed)
    except Exception as error:
        LOGGER.exception("%s cannot be made", name)
        what = f"the twin {name} cannot be made: {type(error).__name__}: {error}"
        raise ConfigError(what, object="vehicle.twin", remedy="mend it; the traceback is in the log") from error
    return world


class SimulatedNetwork:
    """Everything behind the bus, without power at first.

    The world is integrated when somebody looks, and at least every 10 ms while a power stage is on or anything moves,
    so that drives notice faults in time. At rest it costs nothing.

    Args:
        profile: a robot with a simulation section.
        medium: the bus to join.
        seed: of boot delays, measurement noise and the physics' start.

    Attributes:
        world: the truth, for tests.
        stand: the drives that move nothing of the vehicle.
        drives, bricks, encoders, brakes: the twins by their names in the profile.
        scanner: what sees the reflectors; None where the profile has none.

    Raises:
        ConfigError: the profile cannot be simulated.
    """

    def __init__(self, profile: Profile, medium: SimulatedBus, seed: int) -> None:
        random = Random(seed)
        self.world = make_world(profile, seed)
        self.stand = StandWorld(profile, profile.drives.keys() - self.world.axes.keys(), seed)
        self.bricks = {name: simulated_brick(profile, name, seed) for name in profile.bricks}
        simulation = profile.simulation
        factory = simulation.factory if simulation else ()
        self.drives = {
            name: SimulatedEpos(
                medium.port(name),
                msgspec.structs.replace(config, node=FACTORY_NODE) if name in factory else config,
                self.world_of(name).axes[name],
                self.world_of(name),
                random.uniform(*_BOOT_DELAY_S),
                random.getrandbits(32),
            )
            for name, config in profile.drives.items()
        }
        for name in factory:
            self.drives[name].dictionary.forget()
            self.drives[name].dip_switches = ALL_OFF
        defects = simulation.sensors if simulation else {}
        self.encoders = {
            name: SimulatedEncoder(
                medium.port(name),
                config,
                name,
                self.world,
                random.uniform(*_BOOT_DELAY_S),
                SimulatedAngleSensor(defects.get(name, SensorDefects()), f"{seed} {name}"),
            )
            for name, config in profile.encoders.items()
        }
        self.brakes = {name: self._brake(name, config) for name, config in profile.brakes.items()}
        self._wire_inputs(profile)
        self.scanner = self._make_scanner(profile, seed)
        self._watch: asyncio.TimerHandle | None = None
        for drive in self.drives.values():
            drive.on_power_stage = self._on_power_stage

    def _wire_inputs(self, profile: Profile) -> None:
        """An accelerometer and emergency stops that nobody presses, at the inputs of drives."""
        sensor = self.world.accelerometer if isinstance(self.world, OmniWorld) else None
        if sensor is not None and profile.accelerometer is not None:
            for axis in range(2):
                read = partial(sensor.voltage_mv, axis)
                self.drives[profile.accelerometer.drive].connect_analog_input(axis + 1, read)
        for name, config in profile.drives.items():
            if config.emergency_stop:
                self.drives[name].set_digital_input(config.emergency_stop.input, config.emergency_stop.pressed == "low")

    def world_of(self, drive: str) -> BodyWorld:
        """The physics that a drive belongs to."""
        return self.world if drive in self.world.axes else self.stand

    def _make_scanner(self, profile: Profile, seed: int) -> SimulatedScanner | None:
        simulation, localisation = profile.simulation, profile.localisation
        if localisation is None or simulation is None or simulation.scanner is None:
            return None
        places = {name: (mark.x_m, mark.y_m) for name, mark in localisation.reflectors.items()}
        mounted = localisation.scanner

        def look(now_s: float) -> tuple[float, float, float]:
            self.world.advance(now_s)
            world, towed = self.world, mounted.on == "trailer"
            x, y, yaw = world.trailer_pose if towed and isinstance(world, SemitrailerWorld) else world.pose
            ahead, left = mounted.x_m, mounted.y_m
            place = (x + ahead * cos(yaw) - left * sin(yaw), y + ahead * sin(yaw) + left * cos(yaw))
            return (*place, yaw + radians(mounted.rotation_deg))

        return SimulatedScanner(simulation.scanner, places, look, f"{seed} scanner")

    def _brake(self, name: str, config: BrakeConfig) -> SimulatedBrake:
        brake = SimulatedBrake(config, partial(self._move_brake, name))
        self.drives[config.drive].outputs.connect(config.output, brake.set_coil)
        return brake

    def node(self, which: int | str) -> SimulatedNode:
        """A node by its id or its name. Raises KeyError where there is none."""
        nodes: dict[str, SimulatedNode] = {**self.drives, **self.encoders}
        for name, node in nodes.items():
            if which in (name, node.node_id, str(node.node_id)):
                return node
        raise KeyError(which)

    def power_on(self, which: int | str = "all") -> None:
        """Switch on one node, by id or name, or a brick, or all; each node boots after its own delay."""
        for node in self._nodes(which):
            node.power_on()
        for brick in self._bricks(which):
            brick.power_on()

    def power_off(self, which: int | str = "all") -> None:
        """Switch off one node, by id or name, or a brick, or all, at once."""
        for node in self._nodes(which):
            node.power_off()
        for brick in self._bricks(which):
            brick.power_off()

    def set_input(self, node: int, number: int, level: bool) -> None:
        """Apply a level to digital input 1 to 6 of a drive."""
        drive = self.node(node)
        assert isinstance(drive, SimulatedEpos)
        drive.set_digital_input(number, level)

    def turn_sensor(self, node: int, angle_rad: float | None) -> None:
        """Hold the axis of an encoder by hand at an angle; None lets go of it."""
        encoder = self.node(node)
        assert isinstance(encoder, SimulatedEncoder)
        encoder.sensor.held_rad = angle_rad

    @property
    def stands_on_floor(self) -> bool:
        """Whether its wheels touch a floor; a stand's turn in the air."""
        return not isinstance(self.world, StandWorld)

    def tilt(self, slope_rad: float, downhill_rad: float) -> None:
        """Tilt the floor under the robot from now on, as :meth:`BodyWorld.tilt`."""
        self.world.advance(asyncio.get_running_loop().time())
        self.world.tilt(slope_rad, downhill_rad)
        self._wake()

    def _bricks(self, which: int | str) -> list[SimulatedBrick]:
        return [brick for name, brick in self.bricks.items() if which in ("all", name)]

    def _nodes(self, which: int | str) -> list[SimulatedNode]:
        if which in self.bricks:
            return []
        return [*self.drives.values(), *self.encoders.values()] if which == "all" else [self.node(which)]

    async def close(self) -> None:
        """Switch everything off and leave the bus."""
        self.power_off()
        if self.scanner is not None:
            self.scanner.close()
        for node in self._nodes("all"):
            await node.port.close()
        for brick in self.bricks.values():
            await brick.close()
        for brake in self.brakes.values():
            brake.close()
        if self._watch is not None:
            self._watch.cancel()
            self._watch = None

    # Physics

    def _move_brake(self, name: str, engaged: bool) -> None:
        self.world.advance(asyncio.get_running_loop().time())
        self.world.set_brake(name, engaged)
        self._wake()

    def _on_power_stage(self, on: bool) -> None:
        if on:
            self._wake()

    def _wake(self) -> None:
        if self._watch is None:
            self._watch = asyncio.get_running_loop().call_later(_WATCH_S, self._look)

    def catch_up(self) -> None:
        """Bring the physics up to this moment."""
        for world in (self.world, self.stand):
            world.advance(asyncio.get_running_loop().time())

    def _look(self) -> None:
        self._watch = None
        self.catch_up()
        if self.world.moving or self.stand.moving or any(drive.motion.powered for drive in self.drives.values()):
            self._wake()
