"""Faults as chance makes them: any kind that a robot on a CAN bus can suffer, anywhere, for some time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from random import Random
from typing import Any, Final

from drivers.epos.codes import EMERGENCIES
from profiles.faults import KIND_NAMES, KINDS
from profiles.schema import Profile

ELSEWHERE: Final = ("serial_noise", "brick_lost", "disk_full", "disk_slow")
"""Kinds that a robot on a CAN bus does not know, and those of its disk."""
OBJECTS: Final = ("0x1000", "0x1018/1", "0x6040", "0x6041", "0x6060", "0x6064", "0x6083")
OPTIONAL: Final = 0.5
"""Chance of what may be given and need not."""

VALUES: Final[Mapping[str, Callable[[Random], Any]]] = {
    "cob_id": lambda random: random.choice((0x000, 0x080, 0x181, 0x183, 0x203, 0x283, 0x403, 0x583, 0x603, 0x703)),
    "object": lambda random: random.choice(OBJECTS),
    "nth": lambda random: random.randint(1, 50),
    "probability": lambda random: 10.0 ** random.uniform(-3.0, 0.0),
    "times": lambda random: random.randint(1, 100),
    "for_s": lambda random: random.uniform(0.01, 5.0),
    "delay_s": lambda random: 10.0 ** random.uniform(-4.0, -0.5),
    "code": lambda random: random.choice(sorted(EMERGENCIES)),
    "value": lambda random: random.randrange(1 << 16),
    "angle_deg": lambda random: random.uniform(-20.0, 20.0),
    "friction": lambda random: random.uniform(0.01, 0.3),
    "jump_s": lambda random: random.uniform(-1e6, 1e6),
    "clients": lambda random: random.randint(1, 3),
}


def random_fault(profile: Profile, random: Random) -> dict[str, Any]:
    """What ``simulation.fault`` is asked for."""
    name = random.choice([name for name in KIND_NAMES if name not in ELSEWHERE])
    kind = KINDS[name]
    given = [*kind.needs, *(field for field in kind.takes if random.random() < OPTIONAL)]
    fault: dict[str, Any] = {"kind": name}
    for field in given:
        if field == "part":
            fault[field] = random.choice([part for section in kind.parts for part in getattr(profile, section)])
        else:
            fault[field] = VALUES[field](random)
    if name == "encoder_noise":
        fault["angle_deg"] = abs(fault["angle_deg"])
    if name == "wrong_identity":
        fault["object"] = random.choice(("0x1000", "0x1018/1"))
    return fault
