"""An axle that a motor steers: does it turn, to the right side, and does its encoder tell of it?"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from daemon.commissioning.dialogue import Daemon, Person
from daemon.commissioning.pairs import LOCKED, MOVED_DEG, Push, headings_deg
from daemon.commissioning.wheels import JOG_S, Findings, jog
from profiles.schema import DriveConfig, Profile
from profiles.steered import SteeredAxle

STEER_DEG = 15.0
"""How far it is turned to each side."""
TOLERANCE = 0.1
"""Of the angle by the encoder against that by the motor: dry friction and play take their part."""
SIDES = ("left", "right", "none")
QUESTION = "where do the steered wheels point now? left, right, or none where they did not turn"


@dataclass(frozen=True, slots=True)
class Steered:
    """What was seen of a steered axle.

    Attributes:
        side: to which it turned, when it was to turn left: one of :data:`SIDES`.
        motor_deg: angle of the axle by the counts of its drive and the profile's gear.
        turned_deg: what each encoder told, by name.
    """

    side: str
    motor_deg: float
    turned_deg: Mapping[str, float]


def steered_axle(profile: Profile) -> SteeredAxle | None:
    """The axle of a vehicle that has one."""
    axle: SteeredAxle | None = getattr(profile.vehicle, "steering", None)
    return axle


async def look_at_axle(
    daemon: Daemon, person: Person, axle: SteeredAxle, config: DriveConfig, brakes: Sequence[str] = ()
) -> Steered:
    """Steer to the left, ask what is seen, and steer back. Raises CanhelmError, EOFError.

    Args:
        brakes: holding brakes of its drive.
    """
    speed = math.radians(STEER_DEG) * config.wheel_radius_m / JOG_S
    await person.ask(
        f"{axle.drive} (node {config.node}) steers for {JOG_S:g} s as if to the left; press Enter and watch"
    )
    before = await headings_deg(daemon)
    way_m = await jog(daemon, axle.drive, config, speed, brakes)
    after = await headings_deg(daemon)
    while (side := (await person.ask(QUESTION)).lower()) not in SIDES:
        person.tell("say left, right or none")
    await jog(daemon, axle.drive, config, -speed, brakes)
    turned = {name: angle - before[name] for name, angle in after.items()}
    return Steered(side, math.degrees(way_m / config.wheel_radius_m), turned)


def judge_axle(seen: Steered, axle: SteeredAxle, config: DriveConfig, findings: Findings) -> Push | None:
    """Put what was seen into the findings; what the encoders told of it, as of a push to the left."""
    if seen.motor_deg < MOVED_DEG:
        findings.unsolved.append(f"{axle.drive} does not turn, or is not counted: check motor cable and encoder cable")
        return None
    if seen.side == "none":
        findings.unsolved.append(f"{axle.drive} counts, and does not turn the axle: check the coupling")
        return None
    sign = 1 if seen.side == "left" else -1
    if sign < 0:
        findings.wrong.append(f"reversed: {axle.drive} steers to the right when it shall steer to the left")
        findings.values["drives", axle.drive, "direction"] = -config.direction
    told_deg = max(abs(angle) for angle in seen.turned_deg.values())
    if told_deg >= MOVED_DEG and not math.isclose(seen.motor_deg, told_deg, rel_tol=TOLERANCE):
        ratio = config.total_ratio * seen.motor_deg / told_deg
        words = f"{ratio:.4g} motor turns a turn of the axle, not {config.total_ratio:.4g}"
        findings.wrong.append(f"gear: {axle.drive} has {words}")
        findings.values["drives", axle.drive, "belt_ratio"] = round(ratio / config.gear_ratio, 4)
    return Push(axle.encoder, LOCKED, moved=True, turned_deg={k: sign * angle for k, angle in seen.turned_deg.items()})
