"""The methods of the socket API as data: what the server checks requests against and ``api.schema`` prints."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from daemon.api.encoder_methods import ENCODER_METHODS
from daemon.api.gamepad_methods import GAMEPAD_METHODS
from daemon.api.lease_methods import LEASE_METHODS
from daemon.api.localisation_methods import LOCALISATION_METHODS
from daemon.api.look_methods import LOOK_METHODS
from daemon.api.nxt_methods import NXT_METHODS
from daemon.api.parameters import REQUIRED, Method, Param, Role
from daemon.api.path_methods import PATH_METHODS
from daemon.api.setup_methods import SETUP_METHODS
from daemon.api.simulation_methods import SIMULATION_METHODS

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


def _angle(name: str, doc: str, **more: Any) -> Param:
    return Param(name, "number", doc, "deg", minimum=-180.0, maximum=180.0, **more)


_TALK = (
    Method("hello", "Who answers.", (), "api_version, version, robot, state, lease_timeout_s, role, name", Role.STOP),
    Method(
        "client.name",
        "What people call this client; told beside its user and program (name of hello and of a holder).",
        (Param("name", "string", "1 to 60 characters"),),
        "name",
        Role.WATCH,
    ),
    Method("api.schema", "Every method, event and error.", (), "methods, notifications, errors", Role.WATCH),
    Method(
        "status",
        "State at a glance.",
        (),
        "state, message, nodes, brakes, vehicle, holder (who has the robot), role and lease (the caller's), "
        "localisation, bus, cycle, recording, events, role_remedy (how the caller gets the next role)",
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
    Method(
        "bus.frames",
        "Frames of the bus as lines of a candump log; the answer waits a moment for them.",
        (Param("after", "integer", "the last answer's next; from now on where left out", default=None, minimum=0),),
        "frames, next, lost",
        Role.WATCH,
    ),
)

_WHOLE = (
    Method(
        "stop",
        "Stop everything now; answers at rest. Needs no lease.",
        (Param("reason", "string", "how it was, for people; commanded, and by whom, where left out", default=None),),
        "state, enabled, message",
        Role.STOP,
        urgent=True,
    ),
    Method(
        "estop",
        "Emergency stop: quick stop, disable, latched until reset. Needs no lease.",
        (Param("reason", "string", "why, for people", default="commanded by a person"),),
        "state, message",
        Role.STOP,
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
        "drive.heading",
        "Steer to a heading of the frame that began with the daemon, and drive at a speed.",
        (Param("heading_deg", "number", "counter-clockwise positive", "deg"), _SPEED, _DURATION, _WAIT),
        "motion, x_m, y_m, heading_deg, heading_error_deg, duration_s",
        needs_lease=True,
    ),
    Method(
        "drive.rotate",
        "Turn about the own centre.",
        (Param("rate_deg_s", "number", "yaw rate", "deg/s"), _TIME, _WAIT),
        "motion, x_m, y_m, heading_deg, duration_s",
        needs_lease=True,
        ends_by="duration_s",
    ),
    Method(
        "drive.to",
        "Drive to a place, heading and velocity of the frame that began with the daemon.",
        (
            Param("x_m", "number", "forward of the start", "m"),
            Param("y_m", "number", "to the left of the start", "m"),
            Param("heading_deg", "number", "counter-clockwise; as it is where left out", "deg", default=None),
            Param("end_vx_m_s", "number", "velocity at the goal", "m/s", default=0.0),
            Param("end_vy_m_s", "number", "velocity at the goal", "m/s", default=0.0),
            Param(
                "speed_m_s",
                "number",
                "no faster than; the vehicle's limit where left out",
                "m/s",
                default=None,
                minimum=0.001,
            ),
            Param(
                "planner",
                "string",
                "the time-optimal one, or that of the Turtle robot's report",
                default="optimal",
                choices=("optimal", "published"),
            ),
            _WAIT,
        ),
        "motion, result, x_m, y_m, heading_deg, duration_s, error_m, heading_error_deg, least_safety_factor",
        needs_lease=True,
    ),
    Method(
        "drive.set",
        "Drive by direction and speed; the vehicle stops when the last value is too old. Answers at once.",
        (
            _angle("direction_deg", "direction in the robot's frame", default=0.0),
            _SPEED,
            Param("yaw_rate_deg_s", "number", "turn while driving, on vehicles that can", "deg/s", default=0.0),
            _angle("steering_deg", "of the front wheels, where they steer (a rear pair: against it)", default=None),
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
        "Store another node id in a drive or an LSS device; it counts at once; refused while anything is enabled.",
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
        (_NODE, _SETTINGS, _PRODUCT),
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
        (_NODE, replace(_SETTINGS, default=REQUIRED, doc="settings by object"), _PRODUCT, _DRY_RUN),
        _CHANGED,
        Role.CONFIGURE,
    ),
)

METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        *_TALK,
        *LEASE_METHODS,
        *_WHOLE,
        *_MOTOR,
        *_VEHICLE,
        *PATH_METHODS,
        *_NETWORK,
        *_NODES,
        *_CONFIG,
        *NXT_METHODS,
        *LOOK_METHODS,
        *LOCALISATION_METHODS,
        *ENCODER_METHODS,
        *SETUP_METHODS,
        *GAMEPAD_METHODS,
        *SIMULATION_METHODS,
    )
}

NOTIFICATIONS = {
    "status": "params as the result of status, plus lost_samples",
    "event": "time_s, unix_s (time of day), severity (info, warning, error), source, message, remedy",
}


def stops(message: dict[str, Any] | str) -> bool:
    """Whether a message asks for a method that stops the robot."""
    name = message.get("method") if isinstance(message, dict) else None
    return isinstance(name, str) and name in METHODS and METHODS[name].urgent
