"""Holding brakes tried by hand: does each hold its axis when it is locked, and let it go when it is released?"""

from __future__ import annotations

from daemon.commissioning.dialogue import Daemon, Person, agrees
from daemon.commissioning.pairs import NEVER_LOCKS, NEVER_RELEASES
from daemon.commissioning.wheels import Findings
from profiles.schema import BrakeConfig, Profile


def holding_brakes(profile: Profile, drives: list[str]) -> dict[str, BrakeConfig]:
    """The holding brakes of some drives, by their names."""
    brakes = profile.brakes.items()
    return {name: brake for name, brake in brakes if brake.kind == "holding" and brake.drive in drives}


async def look_at_holding_brake(
    daemon: Daemon, person: Person, name: str, brake: BrakeConfig, findings: Findings
) -> None:
    """Try a brake by hand, with its drive off. It is locked at the end. Raises CanhelmError, EOFError."""
    question = f"the {name} brake is {{}}: does {brake.drive} turn by hand?"
    await daemon.call("brake.engage", pair=name)
    locked = await agrees(person, question.format("locked"))
    await daemon.call("brake.release", pair=name, force=True)
    released = await agrees(person, question.format("released"))
    await daemon.call("brake.engage", pair=name)
    if locked and released:
        findings.unsolved.append(f"the {name} brake {NEVER_LOCKS}")
    elif not locked and not released:
        findings.unsolved.append(f"the {name} brake {NEVER_RELEASES}")
    elif locked:
        findings.wrong.append(f"reversed: the {name} brake releases when it shall lock")
        findings.values["brakes", name, "energise_to_release"] = not brake.energise_to_release
