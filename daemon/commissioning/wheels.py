"""One wheel at a time, in the air: which one turns, which way, and how many counts a turn has."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeVar

import msgspec

from canhelm.errors import CanhelmError
from daemon.commissioning.dialogue import Daemon, Person, agrees, number, told
from profiles.feasibility import objection
from profiles.schema import DriveConfig, Profile

T = TypeVar("T")
JOG_M_S = 0.1
JOG_S = 2.0
LEAST_SHARE = 0.2
"""Share of the commanded way, and of a turn by hand, below which a wheel has not turned."""
TOLERANCE = 0.015
"""Of the counts of one turn by hand: five degrees. An encoder of 512 pulses differs from one of 500 by 0.024."""
DOUBTFUL = 0.1
"""Share by which a gear has to differ from the profile's until a turn that was no whole one is the likelier cause."""
PULSES = (16, 7500)
"""What an EPOS takes as pulses of its encoder (object 0x2210/1)."""
QUESTION = "which wheel turned, and which way? forward, backward or none; another wheel as `NAME forward`"
Values = dict[tuple[str, ...], Any]


@dataclass(slots=True)
class Findings:
    """What a commissioning has found.

    Attributes:
        wrong: what was wrong and is put right by ``values``.
        unsolved: what a person has to mend before the robot may be driven.
        values: of the profile, by their keys, where they differ from what it says.
    """

    wrong: list[str] = field(default_factory=list)
    unsolved: list[str] = field(default_factory=list)
    values: Values = field(default_factory=dict)

    def put(self, part: str, name: str, found: Mapping[str, Any], config: msgspec.Struct) -> None:
        """Note values of one drive, encoder or brake, where they differ from its profile."""
        for key, value in found.items():
            if value != getattr(config, key):
                self.values[part, name, key] = value


@dataclass(frozen=True, slots=True)
class Seen:
    """What was seen of one drive.

    Attributes:
        drive: the one that was commanded.
        wheel: the one that turned; empty where none did.
        forward: which way.
        moved: it counted at least a part of the commanded way.
        turn_qc: counts of one turn forward by hand; 0 where the wheel turned and did not count.
        pulses: of its encoder, as its label says; the profile's where the counts fit.
        radius_m: of the wheel.
    """

    drive: str
    wheel: str
    forward: bool
    moved: bool
    turn_qc: int = 0
    pulses: int = 0
    radius_m: float = 0.0


def wheels_of(profile: Profile) -> dict[str, DriveConfig]:
    """The drives that turn wheels, by name; all of them where the robot has no vehicle."""
    names = getattr(profile.vehicle, "wheels", None)
    return {name: profile.drives[name] for name in (profile.drives if names is None else names)}


def seen_wheel(answer: str, commanded: str, wheels: Mapping[str, DriveConfig]) -> tuple[str, bool] | None:
    """The wheel and whether it went forward, from a person's words; an empty name for none, None for no answer."""
    words = answer.lower().split()
    if words == ["none"]:
        return "", False
    *name, way = words or [""]
    wheel = name[0] if len(name) == 1 else commanded
    if len(name) > 1 or wheel not in wheels or way not in ("forward", "backward"):
        return None
    return wheel, way == "forward"


async def jog(daemon: Daemon, drive: str, config: DriveConfig, speed_m_s: float, brakes: Sequence[str] = ()) -> float:
    """Turn one drive for a while; how far it has turned by its own counts [m at the wheel's rim].

    Args:
        brakes: holding brakes of the drive, which are released meanwhile.

    Raises:
        CanhelmError: it does not turn, or a brake does not switch.
    """
    if brakes:
        await daemon.call("motor.enable", node=drive)
        for brake in brakes:
            await daemon.call("brake.release", pair=brake)
    before = await _position_qc(daemon, drive)
    await daemon.call("motor.velocity", node=drive, wheel_speed_m_s=speed_m_s, duration_s=JOG_S)
    way_m = abs(await _position_qc(daemon, drive) - before) * _m_per_qc(config)
    if brakes:
        await daemon.call("motor.disable", node=drive)
    return way_m


async def look_at_wheel(
    daemon: Daemon, person: Person, drive: str, profile: Profile, brakes: Sequence[str] = ()
) -> Seen:
    """Jog one drive, ask what turned, and let the person turn it once by hand. Raises CanhelmError, EOFError."""
    wheels = wheels_of(profile)
    config = wheels[drive]
    speed = min(JOG_M_S, config.max_speed_m_s)
    await person.ask(f"{drive} (node {config.node}) turns for {JOG_S:g} s as if forward; press Enter and watch")
    moved = await jog(daemon, drive, config, speed, brakes) > LEAST_SHARE * speed * JOG_S
    while (answer := seen_wheel(await person.ask(QUESTION), drive, wheels)) is None:
        person.tell(f"wheels are {', '.join(wheels)}; say for instance `forward`, or `{next(iter(wheels))} backward`")
    wheel, forward = answer
    if not wheel or not moved:
        return Seen(drive, wheel, forward, moved)
    for brake in brakes:
        await daemon.call("brake.release", pair=brake, force=True)
    turn_qc, pulses = await _counts_of_a_turn(daemon, person, drive, wheel, wheels[wheel])
    for brake in brakes:
        await daemon.call("brake.engage", pair=brake)
    radius_m = await _radius_m(person, wheel, profile)
    return Seen(drive, wheel, forward, moved, turn_qc, pulses, radius_m)


async def _counts_of_a_turn(
    daemon: Daemon, person: Person, drive: str, wheel: str, config: DriveConfig
) -> tuple[int, int]:
    """Counts of one turn by hand, 0 where there are hardly any, and the pulses of the encoder.

    A gear that is far from the profile's is doubted: half a turn looks like half the gear.
    """
    while True:
        turn_qc = await _turned_by_hand(daemon, person, drive, wheel, _expected_qc(config))
        pulses = config.encoder_pulses_per_turn
        if not turn_qc or _fits(turn_qc, config, pulses):
            return turn_qc, pulses
        person.tell(f"{abs(turn_qc)} counts a turn of {wheel}, and the profile says {_expected_qc(config):.0f}")
        pulses = round(await number(person, "pulses a turn on the label of its encoder", pulses, *PULSES))
        ratio = _ratio(turn_qc, pulses)
        if abs(ratio / config.total_ratio - 1.0) <= DOUBTFUL:
            return turn_qc, pulses
        person.tell(f"that is {ratio:.4g} motor turns a turn of {wheel}, and the profile says {config.total_ratio:.4g}")
        if await agrees(person, f"was it exactly one whole turn of {wheel}? Else it is turned again"):
            return turn_qc, pulses


def _ratio(turn_qc: int, pulses: int) -> float:
    """Motor turns per wheel turn."""
    return abs(turn_qc) / (4 * pulses)


async def _turned_by_hand(daemon: Daemon, person: Person, drive: str, wheel: str, expected_qc: float) -> int:
    """Counts of one turn; asked for again where there are hardly any, unless the person has surely turned the wheel."""
    while True:
        before = await _position_qc(daemon, drive)
        await person.ask(f"turn wheel {wheel} forward by hand, exactly one turn; then press Enter")
        turn_qc = await _position_qc(daemon, drive) - before
        if abs(turn_qc) > LEAST_SHARE * expected_qc:
            return turn_qc
        person.tell(f"{abs(turn_qc)} counts of about {expected_qc:.0f}: not turned, or not connected with its motor")
        if await agrees(person, f"has wheel {wheel} made a whole turn? A mark on its tyre tells"):
            return 0


async def _radius_m(person: Person, wheel: str, profile: Profile) -> float:
    """Radius of a wheel by its diameter; asked for again where the profile's limits are impossible with it."""
    config = profile.drives[wheel]
    while True:
        diameter_mm = await number(person, f"diameter of wheel {wheel} in mm", 2e3 * config.wheel_radius_m)
        fitted = msgspec.structs.replace(config, wheel_radius_m=diameter_mm / 2e3)
        drives = {**profile.drives, wheel: fitted}
        impossible = objection(msgspec.structs.replace(profile, drives=drives))
        if not impossible:
            return fitted.wheel_radius_m
        person.tell(f"{diameter_mm:g} mm do not go with the profile: {impossible}")
        person.tell("measure again; if that is its diameter, press Enter now and change both in the profile later")


async def _position_qc(daemon: Daemon, drive: str) -> int:
    return int((await daemon.call("sdo.read", node=drive, object="position_actual_value"))["value"])


def _m_per_qc(config: DriveConfig) -> float:
    return 2.0 * math.pi * config.wheel_radius_m / _expected_qc(config)


def _expected_qc(config: DriveConfig) -> float:
    return config.qc_per_motor_turn * config.total_ratio


def _fits(turn_qc: int, config: DriveConfig, pulses: int) -> bool:
    return math.isclose(abs(turn_qc), 4 * pulses * config.total_ratio, rel_tol=TOLERANCE)


def judge_wheel(seen: Seen, wheels: Mapping[str, DriveConfig], findings: Findings) -> None:
    """Put what was seen of one drive into the findings."""
    commanded = wheels[seen.drive]
    trouble = _trouble(seen, commanded)
    if trouble:
        findings.unsolved.append(f"{seen.drive} {trouble}")
        return
    wheel, config, direction = seen.wheel, wheels[seen.wheel], _direction(seen)
    if wheel != seen.drive:
        findings.wrong.append(f"swapped: drive {seen.drive} (node {commanded.node}) turns wheel {wheel}")
    if direction != commanded.direction:
        findings.wrong.append(f"reversed: {wheel} rolls backward when it shall roll forward")
    findings.put("drives", wheel, {"node": commanded.node, "direction": direction}, config)
    _judge_size(seen, config, findings)


def _direction(seen: Seen) -> int:
    return 1 if seen.turn_qc > 0 else -1


def _trouble(seen: Seen, commanded: DriveConfig) -> str:
    """What no profile can put right; empty for nothing."""
    if not seen.wheel and not seen.moved:
        return "does not turn a wheel: check motor cable and brake"
    if not seen.wheel:
        return "does not turn a wheel, and its encoder counts: is the shaft loose, or the wheel?"
    if not seen.moved:
        return "turns, and its encoder counts nothing: check the encoder's cable"
    if not seen.turn_qc:
        return "counts with its motor, and not when its wheel is turned by hand: is the wheel loose on its shaft?"
    if _direction(seen) != (commanded.direction if seen.forward else -commanded.direction):
        return "was seen to turn one way and was counted the other way by hand: look again"
    return ""


def _judge_size(seen: Seen, config: DriveConfig, findings: Findings) -> None:
    """Pulses, gear and radius."""
    wheel, pulses = seen.wheel, config.encoder_pulses_per_turn
    if seen.pulses != pulses:
        findings.wrong.append(f"counts: {wheel} has an encoder of {seen.pulses} pulses, not {pulses}")
        findings.values["drives", wheel, "encoder_pulses_per_turn"] = seen.pulses
    if not _fits(seen.turn_qc, config, seen.pulses):
        ratio = _ratio(seen.turn_qc, seen.pulses)
        findings.wrong.append(f"gear: {wheel} has {ratio:.4g} motor turns a wheel turn, not {config.total_ratio:.4g}")
        findings.values["drives", wheel, "belt_ratio"] = round(ratio / config.gear_ratio, 4)
    if not math.isclose(seen.radius_m, config.wheel_radius_m, rel_tol=1e-4):
        sizes = f"{seen.radius_m * 1e3:.4g} mm, not {config.wheel_radius_m * 1e3:.4g} mm"
        findings.wrong.append(f"radius: {wheel} has {sizes}")
        findings.values["drives", wheel, "wheel_radius_m"] = round(seen.radius_m, 6)


async def look_at_wheels(
    daemon: Daemon,
    person: Person,
    chosen: Sequence[str],
    profile: Profile,
    brakes: Mapping[str, Sequence[str]],
    findings: Findings,
) -> None:
    """One drive after the other; one that fails is tried again if the person wants to. Raises EOFError.

    Args:
        chosen: the drives.
        profile: the robot.
        brakes: names of the holding brakes, by their drives.
    """
    turned: dict[str, str] = {}
    wheels = wheels_of(profile)
    for drive in chosen:
        look = partial(look_at_wheel, daemon, person, drive, profile, brakes.get(drive, ()))
        seen = await tried(daemon, person, drive, findings, look)
        if seen is None:
            continue
        if seen.wheel and turned.setdefault(seen.wheel, drive) != drive:
            findings.unsolved.append(f"wheel {seen.wheel} was seen twice, with {turned[seen.wheel]} and {drive}: again")
        judge_wheel(seen, wheels, findings)


async def tried(
    daemon: Daemon, person: Person, drive: str, findings: Findings, look: Callable[[], Awaitable[T]]
) -> T | None:
    """What was seen of a drive; None where it fails and the person gives it up."""
    while True:
        try:
            return await look()
        except CanhelmError as error:
            person.tell(f"{drive}: {told(error)}")
            await daemon.call("reset")
            if not await agrees(person, f"try {drive} again?"):
                findings.unsolved.append(f"{drive}: {told(error)}")
                return None
