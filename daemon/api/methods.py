"""The methods of the socket API as data: what the server checks requests against and ``api.schema`` prints."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

from canhelm.errors import UsageError


class Role(StrEnum):
    """What a peer may do; each role includes those before it."""

    WATCH = "watch"
    DRIVE = "drive"
    CONFIGURE = "configure"


_REQUIRED = object()
MAX_SETTINGS = 1000
"""Settings in one request."""


@dataclass(frozen=True, slots=True)
class Param:
    """One parameter of a method.

    Attributes:
        name: with its unit as suffix.
        type: ``number``, ``integer``, ``boolean``, ``string``, ``node`` (id 1 to 127, or a name), ``value``
            (a number or a string) or ``values`` (whole numbers by object).
        doc: what it means.
        unit: its unit, empty for none.
        default: value where it is left out; a parameter without one is required.
        minimum, maximum: range of a number, both included.
        choices: the only strings allowed, where there are any.
    """

    name: str
    type: str
    doc: str
    unit: str = ""
    default: Any = _REQUIRED
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()

    @property
    def required(self) -> bool:
        """Whether a request without it is refused."""
        return self.default is _REQUIRED

    def schema(self) -> dict[str, Any]:
        """The parameter for ``api.schema``."""
        fields = {"unit": self.unit, "minimum": self.minimum, "maximum": self.maximum, "choices": list(self.choices)}
        known = {key: value for key, value in fields.items() if value not in (None, "", [])}
        default = {} if self.required else {"default": self.default}
        return {"name": self.name, "type": self.type, "doc": self.doc, "required": self.required, **known, **default}


@dataclass(frozen=True, slots=True)
class Method:
    """One method.

    Attributes:
        name: what a request calls it.
        doc: what it does.
        params: its parameters.
        result: what its result holds.
        role: the least role that may call it.
        needs_lease: it moves something, and the motion belongs to the connection that asked for it.
        one_of: exactly one of these parameters must be given.
        ends_by: the parameter without which the motion has no end (and cannot be handed to the daemon).
        urgent: it stops the robot: it is carried out whatever else is under way, and without parameters that make no
            sense instead of being refused.
    """

    name: str
    doc: str
    params: tuple[Param, ...] = ()
    result: str = "state"
    role: Role = Role.DRIVE
    needs_lease: bool = False
    one_of: tuple[str, ...] = ()
    ends_by: str | None = None
    urgent: bool = False

    def schema(self) -> dict[str, Any]:
        """The method for ``api.schema``."""
        return {
            "name": self.name,
            "doc": self.doc,
            "role": self.role.value,
            "needs_lease": self.needs_lease,
            "params": [param.schema() for param in self.params],
            "one_of": list(self.one_of),
            "result": self.result,
        }


_NODE = Param("node", "node", "node id, or name from the profile")
_WAIT = Param("wait", "boolean", "answer when the motion is done; false hands it to the daemon", default=True)
_DURATION = Param("duration_s", "number", "how long the command lasts", "s", minimum=0.01, maximum=3600.0)
_TIME = Param("duration_s", "number", "until stopped where left out", "s", default=None, minimum=0.01, maximum=3600.0)
_SPEED = Param("speed_m_s", "number", "speed of the robot's centre; negative drives backward", "m/s")
_BRAKES = Param("pair", "string", "front, rear or all", default="all")
_OBJECT = Param("object", "string", "name, 0x6041, or 0x2078/1")
_MOTION = Param("motion", "string", "id of the motion")


def _velocity(unit_doc: str, **more: Any) -> Param:
    return Param("velocity_rpm", "number", unit_doc, "rpm", minimum=-100_000.0, maximum=100_000.0, **more)


def _angle(name: str, doc: str) -> Param:
    return Param(name, "number", doc, "deg", minimum=-180.0, maximum=180.0)


_TALK = (
    Method("hello", "Who answers.", (), "api_version, version, robot, state, lease_timeout_s", Role.WATCH),
    Method("api.schema", "Every method, event and error.", (), "methods, notifications, errors", Role.WATCH),
    Method(
        "status",
        "State at a glance.",
        (),
        "state, message, nodes, brakes, vehicle, bus, cycle, recording, events",
        Role.WATCH,
    ),
    Method(
        "subscribe",
        "Send status at a rate, and events as they come; a reader that is too slow loses samples.",
        (Param("rate_hz", "number", "samples a second", "Hz", default=5.0, minimum=0.1, maximum=50.0),),
        "rate_hz",
        Role.WATCH,
    ),
    Method("unsubscribe", "Send no more.", (), "lost_samples", Role.WATCH),
    Method("lease.renew", "The client is alive: its motions go on.", (), "lease", Role.WATCH),
    Method(
        "lease.close", "Stop the motions of this connection; answers when they have ended.", (), "state", Role.WATCH
    ),
)

_WHOLE = (
    Method(
        "stop",
        "Stop everything now; answers at rest. Needs no lease.",
        (),
        "state, enabled, message",
        Role.WATCH,
        urgent=True,
    ),
    Method(
        "estop",
        "Emergency stop: quick stop, disable, latched until reset. Needs no lease.",
        (Param("reason", "string", "why, for people", default="commanded by a person"),),
        "state, message",
        Role.WATCH,
        urgent=True,
    ),
    Method("reset", "Clear a latched emergency stop and faults.", (), "state, message"),
)

_MOTOR = (
    Method("motor.enable", "Switch the power stage on with a zero target.", (_NODE,)),
    Method("motor.disable", "Switch the power stage off.", (_NODE,)),
    Method(
        "motor.velocity",
        "Turn one motor at a velocity.",
        (
            _NODE,
            _velocity("at the motor", default=None),
            Param("wheel_speed_m_s", "number", "at the wheel's rim", "m/s", default=None),
            _TIME,
            _WAIT,
        ),
        "motion",
        needs_lease=True,
        one_of=("velocity_rpm", "wheel_speed_m_s"),
        ends_by="duration_s",
    ),
    Method(
        "motor.position",
        "Turn one motor to a position.",
        (
            _NODE,
            Param("position_qc", "integer", "quad counts", "qc", minimum=-(2**31), maximum=2**31 - 1),
            Param("relative", "boolean", "from where it stands", default=False),
            Param("velocity_rpm", "number", "on the way", "rpm", default=None, minimum=1.0, maximum=100_000.0),
            _WAIT,
        ),
        "motion, position_m",
        needs_lease=True,
    ),
    Method(
        "motor.current",
        "Feed one motor with a current.",
        (_NODE, Param("current_ma", "number", "current", "mA", minimum=-50_000.0, maximum=50_000.0), _TIME, _WAIT),
        "motion",
        needs_lease=True,
        ends_by="duration_s",
    ),
    Method("motor.stop", "End the motion of one motor by its ramp.", (_NODE,)),
    Method("motor.quick_stop", "Quick stop of one motor.", (_NODE,)),
    Method(
        "motor.home",
        "Homing of one motor.",
        (_NODE, Param("method", "integer", "homing method (object 0x6098)", minimum=-128, maximum=127), _WAIT),
        "motion, position_m",
        needs_lease=True,
    ),
    Method("motor.reset", "Clear a fault of one drive.", (_NODE,)),
    Method(
        "motor.step",
        "A step of velocity on one motor.",
        (_NODE, _velocity("at the motor"), _DURATION, _WAIT),
        "motion",
        needs_lease=True,
    ),
)

_VEHICLE = (
    Method("brake.engage", "Engage brakes.", (_BRAKES,), "brakes"),
    Method(
        "brake.release",
        "Release brakes.",
        (_BRAKES, Param("force", "boolean", "release a holding brake although its axis is free", default=False)),
        "brakes",
    ),
    Method("brake.status", "State of brakes.", (_BRAKES,), "brakes", Role.WATCH),
    Method(
        "steer",
        "Turn a pair of wheels, the other pair braked.",
        (Param("pair", "string", "front or rear"), _angle("angle_deg", "heading, counter-clockwise positive"), _WAIT),
        "motion",
        needs_lease=True,
    ),
    Method(
        "drive.parallel",
        "Move without turning.",
        (_angle("angle_deg", "direction in the robot's frame"), _SPEED, _DURATION, _WAIT),
        "motion",
        needs_lease=True,
    ),
    Method(
        "drive.turn",
        "Drive an arc with fixed headings.",
        (
            _angle("rear_deg", "heading of the rear pair"),
            _angle("front_deg", "heading of the front pair"),
            _SPEED,
            _DURATION,
            _WAIT,
        ),
        "motion",
        needs_lease=True,
    ),
    Method(
        "drive.rotate",
        "Turn about the own centre.",
        (Param("rate_deg_s", "number", "yaw rate", "deg/s"), _WAIT),
        "motion",
        needs_lease=True,
    ),
    Method(
        "drive.set",
        "Drive by direction and speed; the vehicle stops when the last value is too old. Answers at once.",
        (
            _angle("direction_deg", "direction in the robot's frame"),
            _SPEED,
            Param("valid_for_ms", "number", "age at which it is too old", "ms", 300.0, 20.0, 1000.0),
        ),
        "motion",
        needs_lease=True,
    ),
)

_NETWORK = (
    Method(
        "nmt",
        "Network management command to one node, or to all nodes of the profile one by one.",
        (
            Param("command", "string", "what", choices=("start", "stop", "preop", "reset", "reset-comm")),
            Param("node", "node", "node id, name, or all"),
        ),
        "nodes, command",
        Role.CONFIGURE,
    ),
    Method("sdo.read", "Read an object of a node.", (_NODE, _OBJECT), "node, object, name, value, unit", Role.WATCH),
    Method(
        "sdo.write",
        "Write an object of a node.",
        (_NODE, _OBJECT, Param("value", "value", "number or string")),
        "node, object, name, value",
        Role.CONFIGURE,
    ),
    Method("motion.wait", "Answer when a motion is done.", (_MOTION,), "motion", Role.WATCH),
    Method("motion.stop", "Stop one motion by its ramp; answers at rest.", (_MOTION,), "motion, state"),
    Method(
        "simulation.power",
        "Switch the supply of a simulated node.",
        (Param("node", "node", "node id, name, or all"), Param("on", "boolean", "on or off")),
        "node, on",
    ),
)

_CONFIRM = Param("confirm", "boolean", "must be true: somebody has agreed", default=False)
_DEVICE = Param("device", "value", "node id, name, or identity as VENDOR:PRODUCT:REVISION:SERIAL")

_NODES = (
    Method(
        "nodes.scan",
        "Who is on the bus: asks node ids and watches for two nodes with one id and for a wrong bit rate.",
        (
            Param("first", "integer", "first node id to ask", default=1, minimum=1, maximum=127),
            Param("last", "integer", "last node id to ask", default=127, minimum=1, maximum=127),
        ),
        "nodes, remarks",
        Role.WATCH,
    ),
    Method(
        "nodes.store",
        "Let a node keep its parameters (0x1010); refused while anything is enabled.",
        (_NODE, _CONFIRM),
        "node, object, note",
        Role.CONFIGURE,
    ),
    Method(
        "nodes.restore",
        "Give a node its factory values back from its next restart on (0x1011); refused while anything is enabled.",
        (_NODE, _CONFIRM),
        "node, object, note",
        Role.CONFIGURE,
    ),
    Method(
        "lss.find",
        "Find one LSS device without a node id by fast scan.",
        (),
        "identity, vendor, product, revision, serial",
        Role.CONFIGURE,
    ),
    Method(
        "lss.set_node_id",
        "Store another node id in an LSS device, and let it count at once; refused while anything is enabled.",
        (_DEVICE, Param("node_id", "integer", "the new node id", minimum=1, maximum=127), _CONFIRM),
        "device, node, note",
        Role.CONFIGURE,
    ),
    Method(
        "lss.set_bit_rate",
        "Store another bit rate in an LSS device for its next power-up; refused while anything is enabled.",
        (_DEVICE, Param("bit_rate", "integer", "bit rate", "bit/s", minimum=10_000, maximum=1_000_000), _CONFIRM),
        "device, bit_rate, note",
        Role.CONFIGURE,
    ),
)

_DRY_RUN = Param("dry_run", "boolean", "only tell what would be written", default=False)
_PRODUCT = Param("product_code", "integer", "of the drive that the settings are of (object 0x1018/2)", default=None)
_SETTINGS = Param("values", "values", "settings by object, as 0x6083 or 0x2078/2; those of the profile where left out",
                  default=None)  # fmt: skip
_CHANGED = "node, name, dry_run, changes, saved, restarted, notes, node_state, status"

_CONFIG = (
    Method("config.dump", "Read all settings of a drive.", (_NODE,), "node, name, values, identity", Role.WATCH),
    Method(
        "config.diff",
        "Compare the settings of a drive.",
        (_NODE, _SETTINGS),
        "node, name, compared, differences, notes",
        Role.WATCH,
    ),
    Method(
        "config.apply",
        "Write settings to a drive and read them back; refused while anything is enabled.",
        (_NODE, _SETTINGS, _PRODUCT, _DRY_RUN, Param("save", "boolean", "keep them, and restart it", default=False)),
        _CHANGED,
        Role.CONFIGURE,
    ),
    Method(
        "config.backup",
        "Read all settings of one drive or of all.",
        (Param("node", "node", "node id, name, or all", default="all"),),
        "drives",
        Role.WATCH,
    ),
    Method(
        "config.restore",
        "Make a drive like the one that the settings are of: write, keep, restart, read back.",
        (_NODE, replace(_SETTINGS, default=_REQUIRED, doc="settings by object"), _PRODUCT, _DRY_RUN),
        _CHANGED,
        Role.CONFIGURE,
    ),
)

METHODS: dict[str, Method] = {
    method.name: method for method in (*_TALK, *_WHOLE, *_MOTOR, *_VEHICLE, *_NETWORK, *_NODES, *_CONFIG)
}

NOTIFICATIONS = {
    "status": "params as the result of status, plus lost_samples",
    "event": "time_s, severity (info, warning, error), source, message, remedy",
}


def validate(method: Method, params: dict[str, Any]) -> dict[str, Any]:
    """The parameters with their defaults filled in.

    Raises:
        UsageError: an unknown, missing, mistyped or out of range parameter, named in ``object``.
    """
    known = {param.name: param for param in method.params}
    if method.urgent:
        params = {name: value for name, value in params.items() if name in known and _fits(known[name], value)}
    for name in params:
        if name not in known:
            has = ", ".join(known) or "no parameters"
            raise _wrong(method, name, "is not a parameter", params[name], f"it takes {has}")
    checked = {name: _check(method, param, params) for name, param in known.items()}
    if method.one_of and sum(checked[name] is not None for name in method.one_of) != 1:
        raise _wrong(method, method.one_of[0], "conflicts or is missing", None, f"give one of {method.one_of}")
    if method.ends_by and checked[method.ends_by] is None and checked["wait"] is False:
        raise _wrong(
            method,
            method.ends_by,
            "is missing: a motion without an end cannot be handed over",
            None,
            "give it, or wait",
        )
    return checked


def _check(method: Method, param: Param, params: dict[str, Any]) -> Any:
    value = params.get(param.name)
    if value is None:
        if param.required:
            raise _wrong(method, param.name, "is missing", None, param.doc)
        return param.default
    fits, wanted = _TYPES[param.type]
    if not fits(value):
        raise _wrong(method, param.name, f"is not {wanted}", value, f"{param.name}: {param.doc}")
    if param.choices and value not in param.choices:
        raise _wrong(method, param.name, "is none of its values", value, f"give {', '.join(param.choices)}")
    if param.type in ("number", "integer"):
        _check_range(method, param, value)
    return value


def _fits(param: Param, value: Any) -> bool:
    return _TYPES[param.type][0](value)


def _check_range(method: Method, param: Param, value: float) -> None:
    low, high = param.minimum, param.maximum
    if (low is not None and value < low) or (high is not None and value > high):
        limit = f"{_digits(low)} .. {_digits(high)} {param.unit}".strip()
        raise _wrong(method, param.name, "is out of range", value, f"stay within {limit}", limit)


def _digits(bound: float | None) -> str:
    return "" if bound is None else f"{bound:.12g}"


def _wrong(method: Method, name: str, what: str, value: Any, remedy: str, limit: str | None = None) -> UsageError:
    shown = "" if value is None else f" ({_short(value)!r})"
    return UsageError(
        f"{method.name}: {name}{shown} {what}", object=name, value=_short(value), limit=limit, remedy=remedy
    )


def _short(value: Any) -> Any:
    return value if value is None or isinstance(value, int | float) else str(value)[:80]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e15 and math.isfinite(value)


def _is_integer(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and 0 < len(value) <= 256 and value.isprintable()


def _is_settings(value: Any) -> bool:
    return isinstance(value, dict) and len(value) <= MAX_SETTINGS and all(map(_is_integer, value.values()))


def _is_node(value: Any) -> bool:
    return 1 <= value <= 127 if _is_integer(value) else _is_text(value)


_TYPES: dict[str, tuple[Callable[[Any], bool], str]] = {
    "number": (_is_number, "a number from -1e15 to 1e15"),
    "integer": (_is_integer, "an integer"),
    "boolean": (lambda value: isinstance(value, bool), "true or false"),
    "string": (_is_text, "a string of 1 to 256 printable characters"),
    "node": (_is_node, "a node id from 1 to 127, or a name"),
    "values": (_is_settings, f"at most {MAX_SETTINGS} whole numbers by object"),
    "value": (lambda value: _is_number(value) or _is_text(value), "a number or a string"),
}
