"""What a vehicle kind of one's own derives from: a law that the daemon asks once a cycle. See docs/own-vehicle.md.

The daemon does the rest: leases, limits before the encoding, odometry, streams of set-points, stops and faults.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar, NamedTuple

from daemon.loops.measurement import Command, Measurement
from profiles.schema import Limits


class Twist(NamedTuple):
    """Motion of the robot's body in its own frame (or, over a short time, its way in metres and radians)."""

    forward_m_s: float
    left_m_s: float
    yaw_rate_rad_s: float


class OwnVehicle(ABC):
    """A law. A new one is made for each motion, so that it may keep what it needs between steps.

    Args:
        given: the profile's ``vehicle.parameters``: exactly those named in ``parameters``.
        limits: the profile's ``limits``. The gate enforces speed and acceleration of the wheels after each step.

    Attributes:
        wheels, encoders, brakes: how many it has.
        parameters: names of the numbers that it needs.

    Raises:
        ValueError: of an own ``__init__``: the numbers make no sense; shown with file and line of the profile.
    """

    wheels: ClassVar[int]
    encoders: ClassVar[int] = 0
    brakes: ClassVar[int] = 0
    parameters: ClassVar[tuple[str, ...]] = ()

    def __init__(self, given: Mapping[str, float], limits: Limits) -> None:
        self.given = given
        self.limits = limits

    @abstractmethod
    def step(self, measurement: Measurement, target: Twist | None, dt_s: float) -> Command:
        """One cycle: what the wheels shall do now.

        Args:
            measurement: this cycle's readings, in the order of the profile's ``wheels``, ``encoders``, ``brakes``.
            target: what the robot's body shall do, within speed and yaw rate of the limits; None: come to rest.
            dt_s: time since the last step.

        Returns:
            Rim speed of each wheel and, with steering brakes, which to release. With ``target`` None the motion is over
            once every wheel is at rest.
        """

    @abstractmethod
    def body_motion(self, rolled: Sequence[float], heading_rad: Sequence[float]) -> Twist:
        """The body's motion that fits what the wheels do best. It is the odometry, called in each cycle.

        Args:
            rolled: rim speed of each wheel [m/s]; then the answer is a speed. Or its way since the last cycle [m]; then
                the answer is the body's way.
            heading_rad: of each steering encoder.
        """

    def objection(self, twist: Twist) -> str:
        """Why the robot cannot do this; empty where it can. The daemon refuses the command with this sentence."""
        return ""
