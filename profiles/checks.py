"""Whether the parts of a profile fit together: version, node ids, references, wiring of the brakes.

These checks work on plain data, so that they also find what is wrong with the rest of a profile whose types are wrong.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from profiles.provenance import FieldPath, Mistake, Node, dotted, place_of
from profiles.schema import SCHEMA_VERSION

REFERENCES = {"wheels": "drives", "encoders": "encoders", "brakes": "brakes"}
"""Lists of names, or mappings by name, in ``vehicle`` and the part that defines the names."""
SINGLE = {("steering", "drive"): "drives", ("steering", "encoder"): "encoders", ("trailer", "encoder"): "encoders"}
"""Single names in parts of ``vehicle``, likewise."""
NEEDED = {
    "paired_steer": (
        ("limits", "steering_rim_speed_m_s"),
        ("limits", "heading_deg"),
        ("simulation", "steering_inertia_kg_m2"),
        ("simulation", "steering_friction_n_m"),
        ("simulation", "brake_holding_torque_n_m"),
    ),
    "ackermann": (
        ("limits", "lateral_acceleration_m_s2"),
        ("simulation", "steering_inertia_kg_m2"),
        ("simulation", "steering_friction_n_m"),
    ),
    "semitrailer": (
        ("limits", "lateral_acceleration_m_s2"),
        ("simulation", "steering_inertia_kg_m2"),
        ("simulation", "steering_friction_n_m"),
    ),
    "omni": (("limits", "yaw_rate_deg_s"), ("limits", "yaw_acceleration_deg_s2")),
}
"""What a type of vehicle needs, and others do not."""
STRONG_OUTPUT = 4
"""DigOUT4 carries 1 A, the others 100 mA (maxon EPOS 24/5 Hardware Reference 6.3)."""
FIRST_OUTPUT_BIT = 15
"""DigOUT1 is general purpose A, bit 15; each next output is one bit lower (Firmware Specification 14.1.41)."""


@dataclass(frozen=True, slots=True)
class Finding:
    """A mistake, or a warning, at a path of the profile.

    Attributes:
        path: keys and indices from the root.
        what: what is wrong.
        remedy: what to do.
        warning: True when the profile may be used all the same.
        other: path of a second place that belongs to it; its file:line is put where ``what`` says ``{other}``.
    """

    path: FieldPath
    what: str
    remedy: str
    warning: bool = False
    other: FieldPath | None = None

    def located(self, tree: Node) -> Mistake:
        """The mistake with its file and line; of two places the one in the robot's own file is blamed."""
        path, place, what = self.path, place_of(tree, self.path), self.what
        if self.other is not None:
            other, other_place = self.other, place_of(tree, self.other)
            if place.file != tree.place.file == other_place.file:
                path, place, other, other_place = other, other_place, path, place
            what = what.replace("{other}", f"{dotted(other)} ({other_place})")
        return Mistake(place, dotted(path), what, self.remedy)


def findings(data: dict[str, Any], complete: bool = True) -> Iterator[Finding]:
    """Everything that does not fit together in a profile's plain data.

    Args:
        data: the profile.
        complete: False where a file that it extends could not be read, and may have given what is missing.
    """
    if complete and data.get("drives", {}) == data.get("bricks", {}) == {}:
        yield Finding(("drives",), "is missing, and so is bricks", "write drives: or bricks: with a mapping")
    yield from _version(data)
    yield from _node_ids(data)
    yield from _motors(data)
    yield from _vehicle_names(data)
    yield from _needed(data)
    yield from _brakes(data)
    yield from _accelerometer(data)
    yield from _traction(data)
    yield from _encoders(data)
    yield from _localisation(data)
    yield from _factory(data)
    yield from _jerk(data)
    yield from _unused(data)


def part(data: Any, key: str) -> dict[str, Any]:
    """The mapping under ``key``; empty when there is none."""
    value = data.get(key) if isinstance(data, dict) else None
    return value if isinstance(value, dict) else {}


def _defined(data: dict[str, Any], kind: str) -> dict[str, Any] | None:
    """What a part defines, by name; None where the part itself is a mistake, which the types tell."""
    value = data.get(kind, {})
    return value if isinstance(value, dict) and (value or kind != "drives") else None


def _version(data: dict[str, Any]) -> Iterator[Finding]:
    version = data.get("schema_version")
    if isinstance(version, int) and version != SCHEMA_VERSION:
        remedy = "install a newer canhelm" if version > SCHEMA_VERSION else f"write schema_version: {SCHEMA_VERSION}"
        yield Finding(("schema_version",), f"is {version}, this canhelm reads {SCHEMA_VERSION}", remedy)


def _node_ids(data: dict[str, Any]) -> Iterator[Finding]:
    first: dict[int, FieldPath] = {}
    for kind in ("drives", "encoders"):
        for name in part(data, kind):
            node, path = part(part(data, kind), name).get("node"), (kind, name, "node")
            if not isinstance(node, int) or first.setdefault(node, path) == path:
                continue
            yield Finding(path, f"node id {node} is taken by {{other}}", "give each its own", other=first[node])


def _motors(data: dict[str, Any]) -> Iterator[Finding]:
    """Motors of bricks: each name once in the robot, each output once in its brick."""
    places: dict[str, FieldPath] = {name: ("drives", name) for name in part(data, "drives")}
    for brick in part(data, "bricks"):
        used: dict[Any, FieldPath] = {}
        for name, motor in part(part(part(data, "bricks"), brick), "motors").items():
            path, output = ("bricks", brick, "motors", name), motor.get("output") if isinstance(motor, dict) else None
            if places.setdefault(name, path) != path:
                yield Finding(path, "has the name of {other}", "give each its own", other=places[name])
            if output is not None and used.setdefault(output, path) != path:
                what = f"output {output} is taken by {{other}}"
                yield Finding((*path, "output"), what, "give each its own", other=used[output])


def _wheels(data: dict[str, Any]) -> dict[str, Any] | None:
    """What may be a wheel of the vehicle: drives on CAN, and on two wheels motors of bricks, too."""
    drives, bricks = _defined(data, "drives"), part(data, "bricks")
    if part(data, "vehicle").get("type") != "differential" or not bricks:
        return drives
    return (drives or {}) | {name: motor for brick in bricks for name, motor in part(bricks[brick], "motors").items()}


def _vehicle_names(data: dict[str, Any]) -> Iterator[Finding]:
    for key, kind in REFERENCES.items():
        given = part(data, "vehicle").get(key)
        names = _names(part(data, "vehicle"), key)
        known = _wheels(data) if key == "wheels" else _defined(data, kind)
        for index, name in enumerate(names):
            path = ("vehicle", key, name if isinstance(given, dict) else index)
            if known is not None and name not in list(known):  # it may have no hash
                yield _unknown(path, kind, name, known)
            elif name in names[:index]:
                yield Finding(path, f"{name!r} stands here twice", f"name each of {kind} once")
    yield from _steering(data)


def _steering(data: dict[str, Any]) -> Iterator[Finding]:
    vehicle, steering = part(data, "vehicle"), part(part(data, "vehicle"), "steering")
    for (where, key), kind in SINGLE.items():
        name, path, known = part(vehicle, where).get(key), ("vehicle", where, key), _defined(data, kind)
        if isinstance(name, str) and known is not None and name not in known:
            yield _unknown(path, kind, name, known)
    if steering.get("drive") in _names(vehicle, "wheels"):
        yield Finding(("vehicle", "steering", "drive"), "drives a wheel, too", "give the steering a drive of its own")
    limit, stop = steering.get("limit_deg"), steering.get("stop_deg")
    if isinstance(limit, int | float) and isinstance(stop, int | float) and limit >= stop:
        what = f"is {limit:g} deg, the stops are at {stop:g} deg"
        yield Finding(("vehicle", "steering", "limit_deg"), what, f"write less than {stop:g}")


def _names(vehicle: dict[str, Any], key: str) -> list[Any]:
    given = vehicle.get(key)
    return list(given) if isinstance(given, list | dict) else []


def _unknown(path: FieldPath, kind: str, name: Any, known: dict[str, Any]) -> Finding:
    return Finding(path, f"{kind} has no {name!r}", f"use one of: {', '.join(known) or f'({kind} is empty)'}")


def _needed(data: dict[str, Any]) -> Iterator[Finding]:
    kind = part(data, "vehicle").get("type")
    for section, key in NEEDED.get(str(kind), ()):
        if part(data, section) and key not in part(data, section):
            what = f"is missing, a vehicle of type {kind} needs it"
            yield Finding((section, key), what, f"write {key}: with a number")


def _accelerometer(data: dict[str, Any]) -> Iterator[Finding]:
    drive, drives = part(data, "accelerometer").get("drive"), _defined(data, "drives")
    if not isinstance(drive, str) or drives is None:
        return
    path = ("accelerometer", "drive")
    if drive not in drives:
        yield _unknown(path, "drives", drive, drives)
    elif part(drives, drive).get("analog_inputs") is not True:
        remedy = f"write analog_inputs: true at drives.{drive}"
        yield Finding(path, f"{drive} does not tell its analog inputs", remedy)


def _traction(data: dict[str, Any]) -> Iterator[Finding]:
    """Without an accelerometer slip is found by currents, which tell little of a cycle that a drive ramps in."""
    drives = _defined(data, "drives")
    if not part(data, "traction") or part(data, "accelerometer") or drives is None:
        return
    for name in _names(part(data, "vehicle"), "wheels"):
        if name in list(drives) and part(drives, name).get("mode") != "velocity":
            remedy = f"write mode: velocity at drives.{name}, or an accelerometer:"
            yield Finding(("traction",), f"the currents of {name} tell no slip while it ramps by itself", remedy)


def _brakes(data: dict[str, Any]) -> Iterator[Finding]:
    brakes, drives = part(data, "brakes"), _defined(data, "drives")
    wired: dict[tuple[str, int], str] = {}
    for name in brakes:
        brake = part(brakes, name)
        drive, output, bit = brake.get("drive"), brake.get("output", STRONG_OUTPUT), brake.get("output_bit", 12)
        if not (isinstance(drive, str) and isinstance(output, int) and isinstance(bit, int)):
            continue
        if drives is not None and drive not in drives:
            yield _unknown(("brakes", name, "drive"), "drives", drive, drives)
        other = wired.setdefault((drive, output), name)
        if other != name:
            what = f"output {output} of {drive} already switches {{other}}"
            yield Finding(("brakes", name), what, "give each brake its own output", other=("brakes", other))
        if 1 <= output <= STRONG_OUTPUT:
            yield from _wiring(name, output, bit)


def _wiring(name: str, output: int, bit: int) -> Iterator[Finding]:
    fitting = FIRST_OUTPUT_BIT + 1 - output
    if bit != fitting:
        what = f"bit {bit} does not drive output {output}"
        yield Finding(("brakes", name, "output_bit"), what, f"write output_bit: {fitting}")
    if output != STRONG_OUTPUT:
        what = f"output {output} carries 100 mA only"
        remedy = f"use output {STRONG_OUTPUT} (1 A), or a relay"
        yield Finding(("brakes", name, "output"), what, remedy, warning=True)


def _encoders(data: dict[str, Any]) -> Iterator[Finding]:
    for name in part(data, "encoders"):
        encoder = part(part(data, "encoders"), name)
        per_turn = encoder.get("counts_per_turn")
        total, zero = encoder.get("total_counts") or per_turn, encoder.get("zero_counts", 0)
        if not (isinstance(per_turn, int) and isinstance(total, int) and isinstance(zero, int)) or per_turn < 1:
            continue
        if total < per_turn:
            what = f"is {total}, less than one turn"
            yield Finding(("encoders", name, "total_counts"), what, f"write {per_turn} or more")
        if zero >= total:
            what = f"is {zero}, outside the range"
            yield Finding(("encoders", name, "zero_counts"), what, f"write 0 to {total - 1}")


def _factory(data: dict[str, Any]) -> Iterator[Finding]:
    given, drives = part(data, "simulation").get("factory"), _defined(data, "drives")
    for index, name in enumerate(given if isinstance(given, list) else ()):
        if drives is not None and name not in drives:
            yield _unknown(("simulation", "factory", index), "drives", name, drives)


def _localisation(data: dict[str, Any]) -> Iterator[Finding]:
    kind = part(data, "vehicle").get("type")
    if part(data, "localisation") and kind in (None, "omni", "own"):
        yield Finding(("localisation",), "has no vehicle with an odometry to correct", "leave it out")
    if part(part(data, "localisation"), "scanner").get("on") == "trailer" and kind != "semitrailer":
        yield Finding(("localisation", "scanner", "on"), "there is no trailer", "write on: vehicle")
    if part(part(data, "simulation"), "scanner") and not part(data, "localisation"):
        what = "sees no reflectors: there is no localisation"
        yield Finding(("simulation", "scanner"), what, "write localisation: with reflectors")


def _jerk(data: dict[str, Any]) -> Iterator[Finding]:
    kind = part(data, "vehicle").get("type")
    if part(data, "limits").get("jerk_m_s3") is not None and kind not in (None, "omni", "own"):
        what = f"has no effect on a vehicle of type {kind}: only `drive to` of omni-wheels limits its jerk"
        yield Finding(("limits", "jerk_m_s3"), what, "leave it out", warning=True)


def _unused(data: dict[str, Any]) -> Iterator[Finding]:
    vehicle = part(data, "vehicle")
    if not vehicle:
        return
    single = [(kind, part(vehicle, where).get(key)) for (where, key), kind in SINGLE.items()]
    for key, kind in REFERENCES.items():
        named = [name for of_kind, name in single if of_kind == kind and name is not None]
        for name in part(data, kind):
            if (key in vehicle or named) and name not in (*_names(vehicle, key), *named):
                what = f"is not named in vehicle.{key}"
                yield Finding((kind, name), what, "the vehicle's motions do not use it", warning=True)
