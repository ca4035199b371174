"""Faults that are put into a simulated network: what a fault is, the kinds there are, and files of them.

A fault is data: what happens, where, from when on and for how long. ``docs/faults.md`` is for people. A fault of a file
and one that somebody sets through the API are the same thing, checked in the same way.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, get_args, get_type_hints

import msgspec
from msgspec import Meta

from canhelm.errors import UsageError
from profiles.parts import ADDRESS_PATTERN, NotNegative, Part, Positive
from profiles.provenance import Mapping, Mistake, Node, Reader, listed, place_of
from profiles.schema import Profile
from profiles.shape import Shape, expected

KindName = Literal[
    "lose",
    "delay",
    "duplicate",
    "reorder",
    "corrupt",
    "pdo_short",
    "pdo_long",
    "sdo_abort",
    "sdo_timeout",
    "node_reset",
    "communication_reset",
    "power_cycle",
    "silence",
    "babbling",
    "wrong_identity",
    "emcy",
    "encoder_stuck",
    "encoder_jump",
    "encoder_noise",
    "encoder_reversed",
    "brake_slips",
    "brake_stuck",
    "ice",
    "motor_blocked",
    "motor_open",
    "bus_off",
    "unplugged",
    "serial_noise",
    "brick_lost",
    "disk_full",
    "disk_slow",
    "clock_jump",
    "client_flood",
]
KIND_NAMES: tuple[str, ...] = get_args(KindName)
Count = Annotated[int, Meta(ge=1, le=1_000_000_000)]
Share = Annotated[float, Meta(gt=0, le=1)]
CLEARABLE_CLIENTS = 30
"""Of the clients that a daemon has room for; beside more nobody would be let in who could clear their fault."""
ObjectAddress = Annotated[str, Meta(pattern=ADDRESS_PATTERN)]

NODES = ("drives", "encoders")
_WHEN = ("kind", "at_s", "at_frame")
_WHICH = ("nth", "probability", "times", "for_s")
_FRAMES = ("part", "cob_id", "object", *_WHICH)


@dataclass(frozen=True, slots=True)
class Kind:
    """What can be said of one kind of fault, beside when it begins.

    Attributes:
        summary: what happens, in a few words.
        parts: sections of a profile whose names its ``part`` may have; none where it happens to no part.
        needs: fields that must be given.
        takes: fields that may be given.
    """

    summary: str
    parts: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    takes: tuple[str, ...] = ()

    @property
    def fields(self) -> tuple[str, ...]:
        """Every field that a fault of this kind may have."""
        return (*_WHEN, *self.needs, *self.takes)


_AT_NODE, _ANGLE = ("part",), ("part", "angle_deg")
KINDS: dict[str, Kind] = {
    "lose": Kind("frames that nobody gets", NODES, (), _FRAMES),
    "delay": Kind("frames that come late", NODES, ("delay_s",), _FRAMES),
    "duplicate": Kind("frames that come twice", NODES, (), _FRAMES),
    "reorder": Kind("frames that come after the one behind them", NODES, (), _FRAMES),
    "corrupt": Kind("frames with one wrong bit in their data", NODES, (), _FRAMES),
    "pdo_short": Kind("PDOs without their last byte", NODES, (), ("part", "cob_id", *_WHICH)),
    "pdo_long": Kind("PDOs with a byte too many; those of 8 bytes have no room for one", NODES, (),
                     ("part", "cob_id", *_WHICH)),
    "sdo_abort": Kind("SDO requests that a node refuses", NODES, _AT_NODE, ("object", "code", *_WHICH)),
    "sdo_timeout": Kind("SDO requests that a node does not answer", NODES, _AT_NODE, ("object", *_WHICH)),
    "node_reset": Kind("a node that starts anew by itself", NODES, _AT_NODE),
    "communication_reset": Kind("a node that starts its communication anew: it forgets its guarding and keeps power",
                                NODES, _AT_NODE),
    "power_cycle": Kind("a node without power for a while, 1 s unless said", NODES, _AT_NODE, ("for_s",)),
    "silence": Kind("a node that sends nothing, and goes on", NODES, _AT_NODE, ("for_s",)),
    "babbling": Kind("a node that fills the bus with frames of identifier 0x001, or another", NODES, _AT_NODE,
                     ("cob_id", "for_s")),
    "wrong_identity": Kind("a node of another device type, or with another value of another object", NODES, _AT_NODE,
                           ("object", "value", "for_s")),
    "emcy": Kind("a node's emergency message, and the drive's reaction to a code that it knows", NODES,
                 ("part", "code"), ("for_s",)),
    "encoder_stuck": Kind("an encoder that stands", NODES, _AT_NODE, ("for_s",)),
    "encoder_jump": Kind("an encoder that jumps", NODES, _ANGLE, ("for_s",)),
    "encoder_noise": Kind("an encoder that trembles, by this standard deviation", NODES, _ANGLE, ("for_s",)),
    "encoder_reversed": Kind("an encoder that counts the other way round", NODES, _AT_NODE, ("for_s",)),
    "brake_slips": Kind("a brake that does not hold", ("brakes",), _AT_NODE, ("for_s",)),
    "brake_stuck": Kind("a brake that does not open", ("brakes",), _AT_NODE, ("for_s",)),
    "ice": Kind("a wheel on ice, of friction 0.02 unless said", ("drives",), _AT_NODE, ("friction", "for_s")),
    "motor_blocked": Kind("a motor that does not turn", ("drives",), _AT_NODE, ("for_s",)),
    "motor_open": Kind("a motor whose cable is off: no current flows", ("drives",), _AT_NODE, ("for_s",)),
    "bus_off": Kind("the daemon's CAN controller leaves the bus", (), (), ("for_s",)),
    "unplugged": Kind("the daemon's adapter, or serial cable, is pulled out", (), (), ("for_s",)),
    "serial_noise": Kind("bytes on the serial line with a wrong bit", (), ("probability",), ("for_s",)),
    "brick_lost": Kind("an NXT brick out of range", ("bricks",), _AT_NODE, ("for_s",)),
    "disk_full": Kind("the disk that the daemon records on takes nothing more", (), (), ("for_s",)),
    "disk_slow": Kind("the disk that the daemon records on does each thing late", (), ("delay_s",), ("for_s",)),
    "clock_jump": Kind("the clock that the daemon dates its records by is set, forward or back", (), ("jump_s",),
                       ("for_s",)),
    "client_flood": Kind("clients of the daemon that ask as fast as they can, and never read", (), ("clients",),
                         ("for_s",)),
}  # fmt: skip


class Fault(Part, frozen=True, kw_only=True, omit_defaults=True):
    """One fault."""

    kind: KindName
    part: str | None = None
    """To which drive, encoder, brake or brick it happens, by its name. Frames: from it and to it."""
    cob_id: Annotated[int, Meta(ge=0, le=0x7FF)] | None = None
    """Frames of this identifier only."""
    object: ObjectAddress | None = None
    """SDO frames that begin a transfer of this object only, as ``0x6060`` or ``0x1018/2``."""
    at_s: NotNegative = 0.0
    """When it begins: so long after it was set; one of a file is set as the simulation begins."""
    at_frame: Count | None = None
    """When it begins: with this frame on the bus, counted from 1 since it was set."""
    for_s: Positive | None = None
    """How long it lasts; left out: until it is cleared."""
    nth: Count | None = None
    """Only this one of the frames, or requests, that fit; counted from 1."""
    probability: Share = 1.0
    """Share of them that it strikes."""
    times: Count | None = None
    """How many of them it strikes at most."""
    delay_s: Positive | None = None
    """By how much frames come late, or a disk does what it is asked."""
    code: Annotated[int, Meta(ge=0, le=0xFFFF_FFFF)] | None = None
    """EMCY code, or SDO abort code."""
    value: Annotated[int, Meta(ge=0, le=0xFFFF_FFFF)] | None = None
    """What an object says instead of the truth."""
    angle_deg: float | None = None
    """Of an encoder: of the motor shaft, or of the steered axis."""
    friction: Annotated[float, Meta(gt=0, le=2)] | None = None
    """Coefficient of friction."""
    jump_s: Annotated[float, Meta(ge=-1e9, le=1e9)] | None = None
    """By how much the clock is set."""
    clients: Annotated[int, Meta(ge=1, le=64)] | None = None
    """How many there are."""


class FaultFile(Part, frozen=True, kw_only=True):
    """What stands in a file."""

    faults: tuple[Fault, ...]


_WANTED = "write faults: with a list of them"
_FILE_TYPE = msgspec.inspect.type_info(FaultFile)
_TYPES = {name: msgspec.inspect.type_info(kind) for name, kind in get_type_hints(Fault, include_extras=True).items()}
_DEFAULTS = dict(zip(Fault.__struct_fields__[1:], Fault.__struct_defaults__, strict=True))


@dataclass(frozen=True, slots=True)
class Objection:
    """What is wrong with a fault.

    Attributes:
        field: which of its fields.
        what: is wrong.
        remedy: what to write.
    """

    field: str
    what: str
    remedy: str


def objections(fault: Fault, profile: Profile) -> Iterator[Objection]:
    """Everything about a fault that makes no sense for its kind, or in this robot."""
    kind = KINDS[fault.kind]
    given = {field for field, default in _DEFAULTS.items() if getattr(fault, field) != default}
    for field in kind.needs:
        if field not in given:
            remedy = f"write {field}: in a file, {_option(field)} in a command"
            yield Objection(field, f"is missing: {fault.kind} needs it", remedy)
    for field in sorted(given - set(kind.fields)):
        has = ", ".join(kind.fields[1:])
        yield Objection(field, f"means nothing for {fault.kind}", f"leave it out; it takes {has}")
    if fault.at_s and fault.at_frame is not None:
        yield Objection("at_frame", "and at_s are two beginnings", "give one of them")
    if (fault.clients or 0) > CLEARABLE_CLIENTS and fault.for_s is None:
        remedy = f"write for_s: in a file, --for in a command, or at most {CLEARABLE_CLIENTS} clients"
        yield Objection("for_s", "is missing: so many clients keep everybody out who could clear it", remedy)
    if fault.kind == "emcy" and fault.code is not None and fault.code > 0xFFFF:
        yield Objection("code", f"0x{fault.code:X} is no EMCY code", "give 0x0000 to 0xFFFF")
    if fault.part is not None and kind.parts:
        names = [name for section in kind.parts for name in getattr(profile, section)]
        sections = " and ".join(kind.parts)
        if not names:
            yield Objection("part", f"{fault.part!r} cannot be: this robot has no {sections}", "take another kind")
        elif fault.part not in names:
            yield Objection("part", f"{fault.part!r} is none of the {sections}", f"one of {', '.join(names)}")


def _option(field: str) -> str:
    """How ``canhelm sim fault`` takes a field."""
    return "a second word" if field == "part" else f"--{field.removesuffix('_s').removesuffix('_deg')}"


def wanted(field: str) -> str:
    """What a field of a fault may be, in words."""
    return expected(_TYPES[field]).removesuffix(" or nothing")


@dataclass(frozen=True, slots=True)
class PlacedFault:
    """A fault, and where it was written.

    Attributes:
        fault: itself.
        place: ``file:line``.
    """

    fault: Fault
    place: str


def load_faults(file: Path, profile: Profile) -> tuple[PlacedFault, ...]:
    """Read a file of faults for a robot.

    Raises:
        UsageError: it cannot be read, or has mistakes; the message has file:line of each.
    """
    mistakes: list[Mistake] = []
    tree = Reader(file, mistakes, _WANTED).read()
    if tree is None or mistakes:
        raise _mistaken(file, mistakes)
    if not isinstance(tree, Mapping):
        raise _mistaken(file, [Mistake(tree.place, "", "is not a mapping", _WANTED)])
    data = Shape(mistakes).walk(tree, _FILE_TYPE)
    if mistakes:
        raise _mistaken(file, mistakes)
    faults = msgspec.convert(data, FaultFile).faults
    for index, fault in enumerate(faults):
        mistakes += _located(tree, index, objections(fault, profile))
    if mistakes:
        raise _mistaken(file, mistakes)
    places = (place_of(tree, ("faults", index)) for index in range(len(faults)))
    return tuple(PlacedFault(fault, str(place)) for fault, place in zip(faults, places, strict=True))


def _located(tree: Node, index: int, found: Iterator[Objection]) -> Iterator[Mistake]:
    for objection in found:
        place = place_of(tree, ("faults", index, objection.field))
        yield Mistake(place, f"faults[{index}].{objection.field}", objection.what, objection.remedy)


def _mistaken(file: Path, mistakes: list[Mistake]) -> UsageError:
    remedy = "docs/faults.md has the kinds of faults and their keys"
    return UsageError(listed(str(file), mistakes), value=str(file), remedy=remedy)
