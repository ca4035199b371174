"""Wheel pairs and axles pushed by hand: does each brake lock its own pair, and which encoder tells of it, which way?

Everything is pushed with all brakes locked, and again with each of them released. What gives way when tells how each
brake is wired: to which output, and with which polarity.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from daemon.commissioning.dialogue import Daemon, Person, agrees
from daemon.commissioning.wheels import Findings
from profiles.schema import BrakeConfig, EncoderConfig, PairedSteerGeometry, Profile

MOVED_DEG = 5.0
"""An encoder that tells less was not turned."""
LOCKED = ""
"""The round in which no brake is released."""


@dataclass(frozen=True, slots=True)
class Push:
    """One push of one pair, to the left.

    Attributes:
        pair: by its encoder's name in the profile.
        released: the pair whose brake was commanded to release; :data:`LOCKED` for none.
        moved: whether it gave way.
        turned_deg: what each encoder told, by name.
    """

    pair: str
    released: str
    moved: bool
    turned_deg: Mapping[str, float]


async def push_pairs(daemon: Daemon, person: Person, geometry: PairedSteerGeometry) -> list[Push]:
    """All pushes. The brakes are locked at the end. Raises CanhelmError, EOFError."""
    brakes = dict(zip(geometry.encoders, geometry.brakes, strict=True))
    pushes = []
    for released in (LOCKED, *geometry.encoders):
        await daemon.call("brake.engage", pair="all")
        if released:
            await daemon.call("brake.release", pair=brakes[released])
        person.tell(f"the {brakes[released]} brake is released" if released else "both brakes are locked")
        pushes += [await _push(daemon, person, pair, released) for pair in geometry.encoders]
    await daemon.call("brake.engage", pair="all")
    return pushes


async def _push(daemon: Daemon, person: Person, pair: str, released: str) -> Push:
    before = await headings_deg(daemon)
    moved = await agrees(person, f"push the {pair} pair to the left by hand, about 20 degrees: does it turn?")
    after = await headings_deg(daemon)
    if moved:
        await person.ask(f"turn the {pair} pair back straight ahead, then press Enter")
    return Push(pair, released, moved, {name: angle - before[name] for name, angle in after.items()})


async def turn_axes(daemon: Daemon, person: Person, encoders: Iterable[str]) -> list[Push]:
    """Axes without brakes of their own, each turned by hand, as that of a trailer. Raises CanhelmError, EOFError."""
    pushes = []
    for name in encoders:
        before = await headings_deg(daemon)
        await person.ask(f"turn the axis of encoder {name} to the left by hand, about 20 degrees; then press Enter")
        after = await headings_deg(daemon)
        await person.ask(f"turn the axis of encoder {name} back straight ahead, then press Enter")
        turned = {encoder: angle - before[encoder] for encoder, angle in after.items()}
        pushes.append(Push(name, LOCKED, moved=True, turned_deg=turned))
    return pushes


async def headings_deg(daemon: Daemon) -> dict[str, float]:
    """What each encoder tells, by name."""
    nodes = (await daemon.call("status"))["nodes"]
    return {node["name"]: float(node["sensed_deg"]) for node in nodes if "sensed_deg" in node}


def judge_encoders(pushes: Sequence[Push], encoders: Mapping[str, EncoderConfig], findings: Findings) -> None:
    """Which encoder tells of which pair, and which way."""
    for pair in dict.fromkeys(push.pair for push in pushes):
        told: dict[str, float] = dict.fromkeys(encoders, 0.0)
        for push in pushes:
            if push.pair == pair and push.moved:
                told = {name: told[name] + push.turned_deg.get(name, 0.0) for name in told}
        name = max(told, key=lambda encoder: abs(told[encoder]))
        if abs(told[name]) < MOVED_DEG:
            findings.unsolved.append(
                f"no encoder tells of the {pair} pair: not turned that far, or its coupling or cable"
            )
            continue
        config = encoders[name]
        direction = config.direction if told[name] > 0.0 else -config.direction
        if name != pair:
            findings.wrong.append(f"swapped: encoder {name} (node {config.node}) tells of the {pair} pair")
        if direction != config.direction:
            findings.wrong.append(f"reversed: the encoder of the {pair} pair counts the other way")
        same = {key: getattr(config, key) for key in ("node", "counts_per_turn", "total_counts", "zero_counts")}
        findings.put("encoders", pair, {**same, "direction": direction}, encoders[pair])


@dataclass(frozen=True, slots=True)
class Wiring:
    """How a brake is wired, as its pair's pushes tell.

    Attributes:
        own: to its own output, not to that of the other brake.
        reversed: it releases when it is told to lock.
    """

    own: bool
    reversed: bool


WIRINGS = {
    (False, True, False): Wiring(own=True, reversed=False),
    (True, False, True): Wiring(own=True, reversed=True),
    (False, False, True): Wiring(own=False, reversed=False),
    (True, True, False): Wiring(own=False, reversed=True),
}
"""By what gave way: with all locked, with its own brake released, with the other one released."""
NEVER_RELEASES = "never releases: check its supply, its cable and the output"
NEVER_LOCKS = "never locks: check its supply, its cable and the output"
DEAD = {(False, False, False): NEVER_RELEASES, (True, True, True): NEVER_LOCKS}


def judge_brakes(pushes: Sequence[Push], profile: Profile, findings: Findings) -> None:
    """How each brake is wired, from what gave way."""
    assert isinstance(profile.vehicle, PairedSteerGeometry)
    brakes = dict(zip(profile.vehicle.encoders, profile.vehicle.brakes, strict=True))
    for pair, brake in brakes.items():
        rounds = {push.released: push.moved for push in pushes if push.pair == pair}
        (other,) = brakes.keys() - {pair}
        pattern = (rounds[LOCKED], rounds[pair], rounds[other])
        wiring = WIRINGS.get(pattern)
        if wiring is None:
            findings.unsolved.append(f"the {brake} brake {DEAD.get(pattern, 'does now this, now that: push again')}")
            continue
        config = profile.brakes[brake if wiring.own else brakes[other]]
        if not wiring.own:
            findings.wrong.append(f"swapped: the {brake} brake is at the output of the {brakes[other]} brake")
        if wiring.reversed:
            findings.wrong.append(f"reversed: the {brake} brake releases when it shall lock")
        findings.put("brakes", brake, _wired(config, wiring), profile.brakes[brake])


def _wired(config: BrakeConfig, wiring: Wiring) -> dict[str, Any]:
    return {
        "drive": config.drive,
        "output": config.output,
        "output_bit": config.output_bit,
        "energise_to_release": config.energise_to_release != wiring.reversed,
    }


def follow_swapped_wheels(profile: Profile, findings: Findings) -> None:
    """Brakes stay at the outputs that they are wired to when drives change their names."""
    nodes = {name: findings.values.get(("drives", name, "node"), drive.node) for name, drive in profile.drives.items()}
    names = {node: name for name, node in nodes.items()}
    for brake, config in profile.brakes.items():
        drive = findings.values.pop(("brakes", brake, "drive"), config.drive)
        now = names.get(profile.drives[drive].node, drive)
        if now != config.drive:
            findings.values["brakes", brake, "drive"] = now
