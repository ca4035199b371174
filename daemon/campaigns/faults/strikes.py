"""What the fault campaign injects, and where: every kind of fault at frames, at requests or at control cycles.

A kind of ``docs/faults.md`` strikes once, or lasts until somebody mends it: frames and requests then have a name that
ends in ``-on``. What a person or the machine may do in the middle of everything (a stop, a client that goes, a daemon
that hangs) strikes likewise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Literal

import msgspec

from drivers.bus.contract import ID_MASK, RTR_FLAG
from drivers.epos.codes import EMERGENCIES
from profiles.faults import KINDS, Fault
from profiles.schema import PairedSteerGeometry, Profile

Where = Literal["frame", "cycle"]
Reach = Literal["pdo", "sdo", "life"]
NODE_MASK: Final = 0x7F
ANY_DATA: Final = range(9)


@dataclass(frozen=True, slots=True)
class Strike:
    """One way in which something breaks.

    Attributes:
        where: whether it strikes with a frame or at the end of a control cycle.
        kind: of ``docs/faults.md``; "" for what a person or the machine does.
        fields: of the fault, beside its part.
        reach: how a drive that it concerns hears of a stop: by its PDOs, by SDO after those were in vain, or not at
            all, so that only the end of its life time stops it.
        lies: whether readings or targets are wrong by as much as no check can notice, so that an answer may be, too.
        silences: whether a device says nothing that can be used any more, which is to be noticed
            while a command is live.
        ids: identifiers of the frames that it can strike.
        lengths: of their data.
    """

    where: Where
    kind: str
    fields: Mapping[str, Any] = field(default_factory=dict)
    reach: Reach = "pdo"
    lies: bool = False
    silences: bool = False
    ids: range = range(0x800)
    lengths: range = ANY_DATA

    def fits(self, can_id: int, length: int) -> bool:
        """Whether it can strike a frame; remote frames carry nothing that could be wrong."""
        number, remote = can_id & ID_MASK, bool(can_id & RTR_FLAG)
        return number in self.ids and length in self.lengths and not (remote and self.lengths is not ANY_DATA)


_ONCE: Final = {"times": 1}
_PDOS, _REQUESTS, _DATA = range(0x181, 0x580), range(0x601, 0x680), range(1, 9)
STRIKES: Final[dict[str, Strike]] = {
    "lose": Strike("frame", "lose", _ONCE),
    "delay": Strike("frame", "delay", {"delay_s": 0.02, **_ONCE}),
    "duplicate": Strike("frame", "duplicate", _ONCE),
    "reorder": Strike("frame", "reorder", _ONCE),
    "corrupt": Strike("frame", "corrupt", _ONCE, reach="life", lies=True, lengths=_DATA),
    "pdo_short": Strike("frame", "pdo_short", _ONCE, ids=_PDOS, lengths=_DATA),
    "pdo_long": Strike("frame", "pdo_long", _ONCE, ids=_PDOS, lengths=range(8)),
    "sdo_abort": Strike("frame", "sdo_abort", _ONCE, ids=_REQUESTS),
    "sdo_timeout": Strike("frame", "sdo_timeout", _ONCE, ids=_REQUESTS),
    "lose-on": Strike("cycle", "lose", reach="life", silences=True),
    "delay-on": Strike("cycle", "delay", {"delay_s": 0.1}, reach="life"),
    "duplicate-on": Strike("cycle", "duplicate", {"probability": 0.5}),
    "reorder-on": Strike("cycle", "reorder", {"probability": 0.2}),
    "corrupt-on": Strike("cycle", "corrupt", {"probability": 0.2}, reach="life", lies=True),
    "pdo_short-on": Strike("cycle", "pdo_short", reach="sdo", silences=True),
    "pdo_long-on": Strike("cycle", "pdo_long", reach="sdo"),
    "sdo_abort-on": Strike("cycle", "sdo_abort"),
    "sdo_timeout-on": Strike("cycle", "sdo_timeout"),
    "node_reset": Strike("cycle", "node_reset", reach="life", silences=True),
    "communication_reset": Strike("cycle", "communication_reset", reach="sdo", silences=True),
    "power_cycle": Strike("cycle", "power_cycle", {"for_s": 0.3}, reach="life", silences=True),
    "silence": Strike("cycle", "silence", reach="life", silences=True),
    "babbling": Strike("cycle", "babbling", {"for_s": 0.5}, reach="life", silences=True),
    "wrong_identity": Strike("cycle", "wrong_identity"),
    "emcy": Strike("cycle", "emcy"),
    "encoder_stuck": Strike("cycle", "encoder_stuck", lies=True),
    "encoder_jump": Strike("cycle", "encoder_jump", {"angle_deg": 10.0}, lies=True),
    "encoder_noise": Strike("cycle", "encoder_noise", {"angle_deg": 0.5}, lies=True),
    "encoder_reversed": Strike("cycle", "encoder_reversed", lies=True),
    "brake_slips": Strike("cycle", "brake_slips"),
    "brake_stuck": Strike("cycle", "brake_stuck"),
    "ice": Strike("cycle", "ice", lies=True),
    "motor_blocked": Strike("cycle", "motor_blocked", lies=True),
    "motor_open": Strike("cycle", "motor_open", lies=True),
    "bus_off": Strike("cycle", "bus_off", reach="life"),
    "unplugged": Strike("cycle", "unplugged", reach="life"),
    "stop": Strike("cycle", ""),
    "estop": Strike("cycle", ""),
    "client_gone": Strike("cycle", ""),
    "daemon_hangs": Strike("cycle", "", reach="life"),
}
"""What strikes, by the name that the command takes and the table shows. Times and shares are the campaign's choice."""

OTHER_ROBOTS: Final = {
    "serial_noise": "needs a serial line",
    "brick_lost": "needs a brick",
    **dict.fromkeys(("disk_full", "disk_slow", "clock_jump"), "needs a recording"),
    "client_flood": "needs a socket",
}
"""Kinds of faults that a MAX2D on CAN, of which nothing is recorded and which has no socket, cannot have."""


@dataclass(frozen=True, slots=True, order=True)
class Injection:
    """One of them at one moment.

    Attributes:
        strike: its name.
        index: of the frame on the bus, or of the control cycle, counted from 1 since the robot got its power.
    """

    strike: str
    index: int

    def __str__(self) -> str:
        return f"{self.strike}:{self.index}"


def part_of(injection: Injection, profile: Profile, seed: int, can_id: int | None) -> str | None:
    """The device that an injection concerns: whose frame it is, or at cycles one after the other.

    Args:
        injection: which.
        profile: the robot's.
        seed: of the campaign; shifts who comes when.
        can_id: of the frame; None at a cycle.
    """
    strike = STRIKES[injection.strike]
    if can_id is not None:
        names = {drive.node: name for name, drive in profile.drives.items()}
        names |= {encoder.node: name for name, encoder in profile.encoders.items()}
        return names.get(can_id & NODE_MASK)
    sections = KINDS[strike.kind].parts if strike.kind else ()
    parts = [name for section in sections for name in getattr(profile, section)]
    return parts[(injection.index + seed) % len(parts)] if parts else None


def names_of(part: str | None, profile: Profile) -> tuple[str, ...]:
    """By which names the daemon may call what concerns a device: a wheel's own, or that of the pair that it turns."""
    vehicle = profile.vehicle
    assert isinstance(vehicle, PairedSteerGeometry)
    if part not in vehicle.wheels:
        return (part,) if part else ()
    return (part, vehicle.encoders[vehicle.wheels.index(part) // 2])


def fault_of(injection: Injection, part: str | None) -> Fault | None:
    """The fault to be set; None for what is none."""
    strike = STRIKES[injection.strike]
    if not strike.kind:
        return None
    fields: dict[str, Any] = {"kind": strike.kind, **strike.fields}
    if strike.kind == "emcy":
        codes = [code for code in EMERGENCIES if code]
        fields["code"] = codes[injection.index % len(codes)]
    takes_part = "part" in KINDS[strike.kind].fields
    if takes_part and (strike.where == "cycle" or strike.kind.startswith("sdo_")):
        fields["part"] = part
    return msgspec.convert(fields, Fault)
