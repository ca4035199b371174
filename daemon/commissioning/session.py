"""A commissioning from its first question to its last: capped, previewed, and undone where it is broken off."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Coroutine, Sequence
from contextlib import asynccontextmanager
from functools import partial
from typing import Any

from canhelm.errors import NodeAbsent, Refused
from daemon.commissioning.dialogue import Daemon, Person, agrees, preview
from daemon.commissioning.holding import holding_brakes, look_at_holding_brake
from daemon.commissioning.pairs import Push, follow_swapped_wheels, judge_brakes, judge_encoders, push_pairs, turn_axes
from daemon.commissioning.steered import judge_axle, look_at_axle, steered_axle
from daemon.commissioning.wheels import Findings, Values, look_at_wheels, tried, wheels_of
from profiles.schema import PairedSteerGeometry, Profile
from profiles.steered import SteeredAxle

ALL, PAIRS = "all", "pairs"
LIMITS = ("continuous_current_limit", "output_current_limit")


class GivenUp(Refused):
    """The person has said no."""


def chosen_wheels(profile: Profile, what: str) -> list[str]:
    """The wheels' drives that a person means: a name, a node id, or all. Raises NodeAbsent."""
    wheels, axle = wheels_of(profile), steered_axle(profile)
    if what == ALL:
        return list(wheels)
    chosen = [name for name, config in wheels.items() if what in (name, str(config.node))]
    if not chosen and what != PAIRS and not chosen_axle(profile, what):
        have = ", ".join([*wheels, axle.drive] if axle else wheels)
        raise NodeAbsent(f"no wheel {what} in this profile", remedy=f"give one of {have}, or pairs, or all")
    return chosen


def chosen_axle(profile: Profile, what: str) -> SteeredAxle | None:
    """The steered axle, where there is one and a person means it."""
    axle = steered_axle(profile)
    return axle if axle and what in (ALL, PAIRS, axle.drive, str(profile.drives[axle.drive].node)) else None


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
        Refused: the robot has motors at an NXT brick.
        EOFError: nobody is there any more; nothing is changed.
        CanhelmError: the daemon refuses, or a brake does not switch.
    """
    if profile.bricks:
        remedy = "try each by `canhelm motor velocity NAME RPM --duration 1`; where all are right, write setup: done"
        raise Refused("motors at an NXT brick are not looked at", remedy=remedy)
    findings, chosen = Findings(), chosen_wheels(profile, what)
    if not await agrees(person, "do all wheels hang in the air, and is everybody clear of them?"):
        raise GivenUp("nothing was changed", remedy="lift the robot first")
    await daemon.call("setup.begin")
    try:
        await daemon.call("brake.engage", pair=ALL)
        axle = chosen_axle(profile, what)
        drives = [*chosen, axle.drive] if axle else chosen
        if not await _holding_brakes_work(daemon, person, profile, drives, findings):
            return findings
        async with capped(daemon, person, drives, current_ma):
            await look_at_wheels(daemon, person, chosen, profile, _holding(profile), findings)
            pushes = await _steer(daemon, person, profile, axle, findings) if axle else []
        if what in (ALL, PAIRS):
            pushes += await _push(daemon, person, profile, findings)
        judge_encoders(pushes, profile.encoders, findings)
    finally:
        await to_its_end(_leave_safe(daemon))
    _conclude(profile, what, findings)
    return findings


def _conclude(profile: Profile, what: str, findings: Findings) -> None:
    """What all that was seen means together."""
    follow_swapped_wheels(profile, findings)
    if what != ALL and any(part == "drives" and keys[-1:] == ["node"] for part, *keys in findings.values):
        findings.unsolved.append("wheels are swapped: look at all of them, `canhelm setup all`")
    if what == ALL and not findings.unsolved:
        findings.values["setup",] = "done"


def _holding(profile: Profile) -> dict[str, list[str]]:
    """Names of the holding brakes, by their drives."""
    brakes = holding_brakes(profile, list(profile.drives))
    return {drive: [name for name, brake in brakes.items() if brake.drive == drive] for drive in profile.drives}


async def _holding_brakes_work(
    daemon: Daemon, person: Person, profile: Profile, drives: list[str], findings: Findings
) -> bool:
    """Whether the holding brakes obey as the profile says; with one that does not, its motor is not to be turned."""
    for name, brake in holding_brakes(profile, drives).items():
        await look_at_holding_brake(daemon, person, name, brake, findings)
    if findings.wrong or findings.unsolved:
        person.tell("the wheels are not looked at before the holding brakes are right: then begin again")
        return False
    return True


async def _steer(daemon: Daemon, person: Person, profile: Profile, axle: SteeredAxle, findings: Findings) -> list[Push]:
    """What the encoders tell of the steered axle, where it turns."""
    config = profile.drives[axle.drive]
    look = partial(look_at_axle, daemon, person, axle, config, _holding(profile)[axle.drive])
    seen = await tried(daemon, person, axle.drive, findings, look)
    push = judge_axle(seen, axle, config, findings) if seen else None
    return [push] if push else []


async def _push(daemon: Daemon, person: Person, profile: Profile, findings: Findings) -> list[Push]:
    """What the encoders tell of pairs that are pushed, and of axes that no motor of theirs turns."""
    if isinstance(profile.vehicle, PairedSteerGeometry):
        pushes = await push_pairs(daemon, person, profile.vehicle)
        judge_brakes(pushes, profile, findings)
        return pushes
    axle = steered_axle(profile)
    return await turn_axes(daemon, person, [name for name in profile.encoders if axle is None or name != axle.encoder])


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
    try:
        for drive in dict.fromkeys(drive for drive, _ in lowered):
            await daemon.call("setup.lower", node=drive, current_ma=current_ma)
        yield
    finally:
        await to_its_end(_put_back(daemon, person, told_of=bool(lowered)))


async def to_its_end(tidying: Coroutine[Any, Any, None]) -> None:
    """Tidy up, and be cancelled only afterwards: Ctrl-C may come in the middle of it."""
    task = asyncio.ensure_future(tidying)
    try:
        await asyncio.shield(task)
    except asyncio.CancelledError:
        await asyncio.wait([task])
        raise


async def _leave_safe(daemon: Daemon) -> None:
    await daemon.call("stop")
    await daemon.call("brake.engage", pair=ALL)
    await daemon.call("setup.end")


async def _put_back(daemon: Daemon, person: Person, *, told_of: bool) -> None:
    """The daemon keeps what the limits were; it puts them back without being asked where nobody asks any more."""
    await daemon.call("stop")
    trouble = (await daemon.call("setup.restore"))["trouble"]
    for sentence in trouble:
        person.tell(sentence)
    if told_of and not trouble:
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
