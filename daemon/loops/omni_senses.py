"""What a robot on omni-wheels knows of its motion: by its wheels while they grip, by the observer while they slip."""

from __future__ import annotations

import math
from typing import Final

from daemon.loops.accelerometer import Accelerometer, CentreAcceleration, Mounting, Vector
from daemon.loops.measurement import Measurement
from daemon.loops.odometry import MAX_STEP_M, Pose, moved_along_arc
from daemon.loops.omni import Motion, OmniKinematics, OmniWheel
from daemon.loops.slip_observer import Body, Observed, ObserverTuning, SlipObserver, rim_drive
from profiles.schema import OmniGeometry, Profile

BY_ACCELEROMETER: Final = ObserverTuning(trust_s=0.4, distrust_s=1.0, missed_m_s2=0.1, turning_by_wheels=True)
BY_CURRENTS: Final = ObserverTuning(trust_s=0.25, distrust_s=1.5, slip_m_s=0.12, turning_by_wheels=True)
"""Forces by currents are less exact than an accelerometer: the observer is not to believe them for long."""
LONGEST_SLIP_S: Final = 0.8
"""Slip that lasts longer is the observer's own error, unless an obstacle is pushed: the wheels are believed again."""
PUSHING_M_S2: Final = 1.0
"""Acceleration that an obstacle takes from a robot with slipping wheels, from which on the robot pushes it."""


def omni_kinematics(geometry: OmniGeometry) -> OmniKinematics:
    """Kinematics of a profile's wheels. Raises ValueError where they leave a motion undetermined."""
    wheels = geometry.wheels.values()
    return OmniKinematics([OmniWheel(math.radians(wheel.direction_deg), wheel.lever_m) for wheel in wheels])


def omni_observer(profile: Profile, kinematics: OmniKinematics) -> SlipObserver | None:
    """The observer of a profile's wheels; None where the profile answers no slip, or readings come one by one."""
    traction, vehicle = profile.traction, profile.vehicle
    if traction is None or not isinstance(vehicle, OmniGeometry) or not profile.network.synchronous:
        return None
    by_currents = profile.accelerometer is None
    drives = [rim_drive(profile.drives[name], traction) for name in vehicle.wheels]
    body = Body(vehicle.mass_kg, vehicle.yaw_inertia_kg_m2)
    return SlipObserver(body, drives, kinematics.forward, tuning=BY_CURRENTS if by_currents else BY_ACCELEROMETER)


class OmniOdometry:
    """Adds up what omni-wheels have rolled.

    Attributes:
        pose: where the robot's centre is.
        motion: of the body in its own frame, by the wheels' speeds.
        skipped: readings that were not used because they cannot be true.
    """

    def __init__(self, kinematics: OmniKinematics) -> None:
        self._kinematics = kinematics
        self._last: tuple[float, ...] | None = None
        self.pose = Pose()
        self.motion: Motion = (0.0, 0.0, 0.0)
        self.skipped = 0

    def update(self, measurement: Measurement) -> Pose:
        """Take one cycle's wheel travel; the first one only sets the start."""
        last, self._last = self._last, measurement.wheel_travel_m
        self.motion = self._kinematics.body_motion(measurement.wheel_speed_m_s)
        if last is None or last == self._last:
            return self.pose
        rolled = [new - old for new, old in zip(self._last, last, strict=True)]
        if not all(abs(way) <= MAX_STEP_M for way in rolled):
            self.skipped += 1
            return self.pose
        self.pose = moved_along_arc(self.pose, *self._kinematics.body_motion(rolled))
        return self.pose


class OmniSenses:
    """Pose, motion, acceleration and slip.

    Args:
        kinematics: of the wheels.
        mounting: of the accelerometer; without readings of one the currents tell the acceleration.
        observer: of slip; None: the wheels are always believed.

    Attributes:
        observing: whether slip is looked for.
        centre: the accelerometer's reading as of the robot's centre; None without one.
        acceleration: of the centre in the robot's frame, as told by accelerometer or currents; None without both.
        observed: by the observer, None where slip is not looked for.
    """

    def __init__(self, kinematics: OmniKinematics, mounting: Mounting, observer: SlipObserver | None) -> None:
        self._odometry = OmniOdometry(kinematics)
        self._sensor = Accelerometer(mounting)
        self._observer = observer
        self._slipping_s = 0.0
        self.observing = observer is not None
        self.centre: CentreAcceleration | None = None
        self.acceleration: Vector | None = None
        self.observed: Observed | None = None

    @property
    def pose(self) -> Pose:
        """Where the robot's centre is."""
        return self._odometry.pose

    @property
    def motion(self) -> Motion:
        """Of the body in its own frame."""
        return self._odometry.motion

    @property
    def slipping(self) -> bool:
        """Whether a wheel slips."""
        return self.observed is not None and any(self.observed.slipping)

    @property
    def pushing(self) -> bool:
        """Whether wheels slip because an obstacle holds the robot, and not for want of grip."""
        seen = self.observed
        return seen is not None and any(seen.slipping) and math.hypot(*seen.outside_m_s2) > PUSHING_M_S2

    def update(self, measurement: Measurement, dt: float, *, powered: bool, standing: bool) -> None:
        """One cycle.

        Args:
            measurement: with the accelerometer's reading, and currents where slip is to be found by them.
            dt: time since the last one [s].
            powered: the wheels are driven, and so may slip.
            standing: the robot certainly stands.
        """
        reading = measurement.acceleration_m_s2
        self.centre = None if reading is None else self._sensor.step(reading, self.motion[2], dt, standing)
        self.acceleration = self.centre.centre if self.centre else None
        self.observed = self._observe(measurement, dt, powered)
        self._odometry.update(measurement)

    def _observe(self, measurement: Measurement, dt: float, powered: bool) -> Observed | None:
        if self._observer is None or not self.observing:
            return None
        if not powered:
            self._observer.restart()
            return None
        speeds, currents = measurement.wheel_speed_m_s, measurement.motor_current_a
        seen = self._observer.step(speeds, currents, dt, self.acceleration)
        self._slipping_s = self._slipping_s + dt if any(seen.slipping) else 0.0
        if self._slipping_s > LONGEST_SLIP_S and not self.pushing:
            self._observer.restart()
        self.acceleration = (seen.acceleration[0], seen.acceleration[1])
        return seen
