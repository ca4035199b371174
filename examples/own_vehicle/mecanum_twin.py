"""The body of a robot on mecanum wheels in the simulation: four contacts that hold along their rollers' axes only.

It shares no kinematics with the law: it knows where the wheels are, and what force a bent tyre makes.
"""

from __future__ import annotations

from math import sqrt
from random import Random

from drivers.simulated.body import GRAVITY_M_S2, BodyWorld
from drivers.simulated.motor import WheelDrive
from drivers.simulated.tyre import Contact
from drivers.simulated.world import STEP_S
from profiles.own_vehicle import OwnGeometry
from profiles.schema import Profile

PLACES = ((1, 1, -1), (1, -1, 1), (-1, 1, 1), (-1, -1, -1))
"""Of each wheel: its end, its side, and the side to which its rollers' axis points ahead."""
HALF = sqrt(0.5)


class MecanumWorld(BodyWorld):
    """The robot on a level floor."""

    def __init__(self, profile: Profile, seed: int = 0) -> None:
        vehicle, simulation, random = profile.vehicle, profile.simulation, Random(seed)
        assert isinstance(vehicle, OwnGeometry)
        assert simulation is not None
        given = vehicle.parameters
        drives = {name: WheelDrive(profile.drives[name], simulation, random.random()) for name in vehicle.wheels}
        super().__init__(drives, given["mass_kg"], (0.0, 0.0, 0.0), STEP_S)
        self._yaw_inertia = given["yaw_inertia_kg_m2"]
        self._load_n = given["mass_kg"] * GRAVITY_M_S2 / 4
        self._wheels = [
            (drive, Contact(simulation.tyre), end * given["half_length_m"], side * given["half_width_m"], roller * HALF)
            for drive, (end, side, roller) in zip(drives.values(), PLACES, strict=True)
        ]

    def _step(self) -> None:
        """Forces by the old velocities, then velocities, then positions."""
        (vx, vy), rate, dt = self._body_velocity(), self._yaw_rate, self._step_s
        force_x = force_y = moment = 0.0
        for drive, contact, x, y, across in self._wheels:
            along_axis = (vx - rate * y) * HALF + (vy + rate * x) * across
            contact.deform(drive.rim_m_s * HALF, along_axis, 0.0, self._load_n, dt)
            fx, fy = contact.force_x_n * HALF, contact.force_x_n * across
            drive.turn(fx, self._load_n, dt)
            force_x, force_y, moment = force_x + fx, force_y + fy, moment + x * fy - y * fx
        self._move(force_x, force_y, moment / self._yaw_inertia, dt)

    @property
    def slip_ratio(self) -> tuple[float, ...]:
        """Along the rollers' axes."""
        return tuple(contact.slip_ratio for _, contact, *_ in self._wheels)

    @property
    def slip_angle_rad(self) -> tuple[float, ...]:
        """None: the rollers leave the other direction free."""
        return (0.0,) * len(self._wheels)

    def heading_rad(self, pair: str) -> float:
        """Raises KeyError: no wheel steers."""
        raise KeyError(pair)
