"""A steered axle: a motor turns it by a gear, dry friction resists, stops end its way.

The axle is what :class:`drivers.simulated.motor.WheelDrive` calls a wheel: its inertia is that of the steering, its
rim the end of the steering arm. The moment of the tyres on the spot is part of the dry friction.
"""

from __future__ import annotations

from math import radians

import msgspec

from drivers.simulated.motor import WheelDrive
from profiles.schema import DriveConfig, SimulationConfig
from profiles.steered import SteeredAxle


class SimulatedSteering:
    """One steered axle.

    Args:
        axle: its stops.
        config: the drive that turns it.
        simulation: inertia and friction of the steering.
        phase: where within one quad count the motor's encoder stands at the start, 0 to 1.

    Attributes:
        drive: motor and gear.
        angle_rad: of the axle, counter-clockwise positive.
    """

    def __init__(
        self, axle: SteeredAxle, config: DriveConfig, simulation: SimulationConfig, phase: float = 0.0
    ) -> None:
        steering = msgspec.structs.replace(
            simulation,
            wheel_inertia_kg_m2=simulation.steering_inertia_kg_m2,
            brake_holding_torque_n_m=simulation.steering_friction_n_m,
        )
        self.drive = WheelDrive(config, steering, phase)
        self.drive.set_brake(engaged=True)
        self.angle_rad = 0.0
        self._stop_rad = radians(axle.stop_deg)

    @property
    def rate_rad_s(self) -> float:
        """Rate of turn relative to the body."""
        return self.drive.wheel_rad_s

    def turn(self, dt_s: float) -> None:
        """Turn for one step."""
        self.drive.turn(0.0, 0.0, dt_s)
        self.follow(dt_s)

    def follow(self, dt_s: float) -> None:
        """Go with the drive for one step, up to the stops."""
        angle = self.angle_rad + self.drive.wheel_rad_s * dt_s
        if -self._stop_rad <= angle <= self._stop_rad:
            self.angle_rad = angle
        else:
            self.angle_rad = self._stop_rad if angle > 0.0 else -self._stop_rad
            self.drive.stop()
