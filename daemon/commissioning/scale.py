"""Wheel radius from a measured straight, track from a measured square.

What the wheels have rolled by odometry is in proportion to their radius, and what the robot has turned by odometry in
inverse proportion to its track (Borenstein and Feng, *Measurement and correction of systematic odometry errors in
mobile robots*, 1996: scale of the wheels' mean diameter, and effective wheelbase E_b).
"""

from __future__ import annotations

import math
from typing import Any

from canhelm.errors import NotReady, Refused
from daemon.commissioning.dialogue import Daemon, Person, number
from daemon.commissioning.wheels import Values
from profiles.bricks import DifferentialGeometry
from profiles.schema import OmniGeometry, Profile

LEAST_M = 0.5
"""A shorter straight tells less than the tape's error."""
MOST = 0.2
"""A scale that differs by more is a mistake of another kind: see ``canhelm setup``."""
FULL_TURN_DEG = 360.0


async def straight(daemon: Daemon, person: Person, profile: Profile) -> Values:
    """Wheel radii, from a straight that the person drives and measures. Raises Refused, NotReady, EOFError."""
    await person.ask("mark where the robot stands, then press Enter")
    start = await _odometry(daemon)
    await person.ask("drive it straight for some metres (`canhelm drive` in another terminal), then press Enter")
    end = await _odometry(daemon)
    by_wheels = math.hypot(end["x_m"] - start["x_m"], end["y_m"] - start["y_m"])
    if by_wheels < LEAST_M:
        raise Refused(f"it went {by_wheels:.3f} m", limit=f"{LEAST_M} m", remedy="drive farther, and measure that")
    factor = _factor(await number(person, "measured distance between the marks in m", round(by_wheels, 4)) / by_wheels)
    return {(*keys, "wheel_radius_m"): round(radius * factor, 6) for keys, radius in _radii(profile).items()}


def _radii(profile: Profile) -> dict[tuple[str, ...], float]:
    """Radii of the wheels that carry the robot, by the keys of their drives or motors."""
    radii: dict[tuple[str, ...], float] = {}
    for name, drive in profile.drives.items():
        radii["drives", name] = drive.wheel_radius_m
    for brick, config in profile.bricks.items():
        for name, motor in config.motors.items():
            radii["bricks", brick, "motors", name] = motor.wheel_radius_m
    wheels = getattr(profile.vehicle, "wheels", profile.wheels)
    return {keys: radius for keys, radius in radii.items() if keys[-1] in wheels}


async def square(daemon: Daemon, person: Person, profile: Profile) -> Values:
    """Track, from a square that the person drives to the left. Raises Refused, NotReady, EOFError."""
    vehicle = profile.vehicle
    if not isinstance(vehicle, DifferentialGeometry | OmniGeometry):
        kind = vehicle.type if vehicle else "without a vehicle"
        remedy = "its headings decide: `canhelm encoder zero`, `canhelm calibrate steering`"
        raise Refused(f"how far a robot of type {kind} turns does not follow from its track", remedy=remedy)
    await person.ask("mark where the robot stands and where it looks to, then press Enter")
    start = await _odometry(daemon)
    await person.ask("drive a square, four quarter turns to the left in all, back to its mark; then press Enter")
    end = await _odometry(daemon)
    turned = await number(person, "degrees that it has turned in all (more than 360: too far)", FULL_TURN_DEG)
    by_wheels = turned + math.remainder(end["yaw_deg"] - start["yaw_deg"] - turned, FULL_TURN_DEG)
    factor = _factor(by_wheels / turned)
    if isinstance(vehicle, DifferentialGeometry):
        return {("vehicle", "half_track_m"): round(vehicle.half_track_m * factor, 6)}
    levers = {name: wheel.lever_m for name, wheel in vehicle.wheels.items()}
    return {("vehicle", "wheels", name, "lever_m"): round(lever * factor, 6) for name, lever in levers.items()}


async def _odometry(daemon: Daemon) -> dict[str, Any]:
    status = await daemon.call("status")
    if status["motions"]:
        raise NotReady("a motion is under way", remedy="wait until the robot is at rest")
    odometry: dict[str, Any] | None = status["vehicle"].get("odometry")
    if odometry is None:
        raise Refused("this robot has no odometry", remedy="its profile needs a vehicle")
    return odometry


def _factor(factor: float) -> float:
    if not 1.0 - MOST <= factor <= 1.0 + MOST:
        remedy = "measure again; else look for a wrong gear or encoder: `canhelm setup`"
        raise Refused(f"a scale of {factor:.3f} is no matter of calibration", value=round(factor, 4), remedy=remedy)
    return factor
