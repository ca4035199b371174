"""A commissioning from its first question to its last: capped, previewed, and undone where it is broken off."""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager
from typing import Any

from canhelm.errors import CanhelmError, NodeAbsent, Refused
from daemon.commissioning.dialogue import Daemon, Person, agrees, preview, told
from daemon.commissioning.pairs import follow_swapped_wheels, judge_brakes, judge_encoders, push_pairs, turn_axes
from daemon.commissioning.wheels import Findings, Values, look_at_wheels
from profiles.schema import DriveConfig, PairedSteerGeometry, Profile

ALL, PAIRS = "all", "pairs"
LIMITS = ("continuous_current_limit", "output_current_limit")


class GivenUp(Refused):
    """The person has said no."""


def wheels_of(profile: Profile) -> dict[str, DriveConfig]:
    """The drives that turn wheels, by name; all of them where the robot has no vehicle."""
    names = getattr(profile.vehicle, "wheels", None)
    return {name: profile.drives[name] for name in (profile.drives if names is None else names)}


def chosen_wheels(profile: Profile, what: str) -> list[str]:
    """The drives that a person means: a name, a node id, or all. Raises NodeAbsent."""
    wheels = wheels_of(profile)
    if what == ALL:
        return list(wheels)
    chosen = [name for name, config in wheels.items() if what in (name, str(config.node))]
    if not chosen and what != PAIRS:
        have = ", ".join(wheels)
        raise NodeAbsent(f"no wheel {what} in this profile", remedy=f"give one of {have}, or pairs, or all")
    return chosen


async def commission(daemon: Daemon, person: Person, profile: Profile, what: str, current_ma: int) -> Findings:
    """Look at wheels, brakes and encoders with a person.

    Args:
        daemon: of the robot, with all drives ready and disabled.
        person: beside it.
        profile: what the daemon runs with.
        what: a wheel's drive, ``pairs`` or ``all``.
        current_ma: highest current meanwhile.

    Raises:
        GivenUp: the person has said no; nothing is changed.
        EOFError: nobody is there any more; nothing is changed.
        CanhelmError: the daemon refuses, or a brake does not switch.
    """
    findings, chosen = Findings(), chosen_wheels(profile, what)
    if not await agrees(person, "do all wheels hang in the air, and is everybody clear of them?"):
        raise GivenUp("nothing was changed", remedy="lift the robot first")
    try:
        await daemon.call("brake.engage", pair=ALL)
        async with capped(daemon, person, chosen, current_ma):
            await look_at_wheels(daemon, person, chosen, wheels_of(profile), findings)
        if what in (ALL, PAIRS):
            await _look_at_pairs(daemon, person, profile, findings)
    finally:
        await daemon.call("stop")
        await daemon.call("brake.engage", pair=ALL)
    follow_swapped_wheels(profile, findings)
    if what != ALL and any(part == "drives" and keys[-1:] == ["node"] for part, *keys in findings.values):
        findings.unsolved.append("wheels are swapped: look at all of them, `canhelm setup all`")
    if what == ALL and not findings.unsolved:
        findings.values["setup",] = "done"
    return findings


async def _look_at_pairs(daemon: Daemon, person: Person, profile: Profile, findings: Findings) -> None:
    if isinstance(profile.vehicle, PairedSteerGeometry):
        pushes = await push_pairs(daemon, person, profile.vehicle)
        judge_brakes(pushes, profile, findings)
    else:
        pushes = await turn_axes(daemon, person, profile.encoders)
    judge_encoders(pushes, profile.encoders, findings)


@asynccontextmanager
async def capped(daemon: Daemon, person: Person, drives: Sequence[str], current_ma: int) -> AsyncIterator[None]:
    """Lower the drives' current limits meanwhile; previewed before, undone after, however it ends."""
    limits = {(drive, name): await _read(daemon, drive, name) for drive in drives for name in LIMITS}
    lowered = {place: old for place, old in limits.items() if old > current_ma}
    if lowered:
        person.tell("these limits are lowered meanwhile, and put back at the end:")
        changes = {f"{drive} {name}": (f"{old} mA", f"{current_ma} mA") for (drive, name), old in lowered.items()}
        for line in preview(changes):
            person.tell(line)
        if not await agrees(person, "write them?"):
            raise GivenUp("nothing was changed", remedy="begin again with another --current")
    written: dict[tuple[str, str], int] = {}
    try:
        for (drive, name), old in lowered.items():
            written[drive, name] = old
            await daemon.call("sdo.write", node=drive, object=name, value=current_ma)
        yield
    finally:
        await daemon.call("stop")
        await _put_back(daemon, person, written)


async def _put_back(daemon: Daemon, person: Person, written: Mapping[tuple[str, str], int]) -> None:
    """One drive that cannot be reached keeps none of the others from getting its limits back."""
    for (drive, name), old in written.items():
        try:
            await daemon.call("sdo.write", node=drive, object=name, value=old)
        except CanhelmError as error:
            person.tell(f"{drive} keeps its lower {name} until it is started anew: {told(error)}")
    if written:
        person.tell("the drives have their current limits back")


async def _read(daemon: Daemon, drive: str, name: str) -> int:
    return int((await daemon.call("sdo.read", node=drive, object=name))["value"])


def changes_of(profile: Profile, values: Values) -> dict[str, tuple[Any, Any]]:
    """What the side file changes: old and new value by dotted name."""
    return {".".join(keys): (_value(profile, keys), new) for keys, new in values.items()}


def _value(profile: Profile, keys: Sequence[str]) -> Any:
    part: Any = profile
    for key in keys:
        part = part[key] if isinstance(part, dict) else getattr(part, key)
    return part
