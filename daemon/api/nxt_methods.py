"""The methods for robots on an NXT brick, as data (see :mod:`daemon.api.methods`)."""

from __future__ import annotations

from typing import Final

from daemon.api.parameters import Method, Param, Role

_BRICK = Param("brick", "string", "name from the profile; the only one where left out", default=None)
_WAIT = Param("wait", "boolean", "answer when the motion is done; false hands it to the daemon", default=True)
_POWER = Param(
    "power", "number", "of the faster wheel; 100 is 1000 degrees a second", default=None, minimum=1, maximum=100
)
_FEEDBACK = Param("feedback", "boolean", "seek the end of each move by odometry, not by tacho limits", default=False)
_COMPENSATE = Param(
    "compensate", "boolean", "take what a wheel turned too far off its next move (the brick does, too)", default=False
)
_SEEKING = (
    Param("tolerance_m", "number", "in x and in y", "m", default=None, minimum=0.0005, maximum=1.0),
    Param("tolerance_deg", "number", "of the heading", "deg", default=None, minimum=0.1, maximum=180.0),
    Param("timeout_s", "number", "after which a goal is given up", "s", default=None, minimum=0.1, maximum=3600.0),
    Param(
        "gains",
        "string",
        "for cycles as slow as Bluetooth, or those of the NXT report",
        default="slow",
        choices=("slow", "report"),
    ),
    Param("speed_m_s", "number", "under feedback, no faster than", "m/s", default=None, minimum=0.001),
)
_ENDS = "motion, x_m, y_m, heading_deg, error_m, heading_error_deg, duration_s, result, tacho_errors_deg"


def _metres(name: str, doc: str) -> Param:
    return Param(name, "number", doc, "m", minimum=-1000.0, maximum=1000.0)


def _motion(name: str, doc: str, *params: Param) -> Method:
    return Method(name, doc, (*params, _WAIT), _ENDS, needs_lease=True)


NXT_METHODS: Final = (
    _motion(
        "nxt.line",
        "Drive straight on by the brick's tacho limits.",
        _metres("distance_m", "negative drives backward"),
        _POWER,
        _FEEDBACK,
        _COMPENSATE,
        *_SEEKING,
    ),
    _motion(
        "nxt.bend",
        "Drive along a circle by the brick's tacho limits.",
        Param("radius_m", "number", "from the circle's centre to the robot's", "m", minimum=0.0, maximum=1000.0),
        Param("angle_deg", "number", "how far", "deg", minimum=-3600.0, maximum=3600.0),
        Param("side", "string", "where to bend", default="left", choices=("left", "right")),
        Param("backward", "boolean", "drive backward", default=False),
        _POWER,
        _FEEDBACK,
        _COMPENSATE,
        *_SEEKING,
    ),
    _motion(
        "nxt.goto",
        "Drive to a pose as seen from where the robot stands, by feedback or open loop (turn, line, turn).",
        _metres("x_m", "forward"),
        _metres("y_m", "to the left"),
        Param("heading_deg", "number", "counter-clockwise", "deg", default=0.0, minimum=-180.0, maximum=180.0),
        _POWER,
        Param("feedback", "boolean", "by odometry; false: by tacho limits", default=True),
        _COMPENSATE,
        *_SEEKING,
    ),
    _motion(
        "nxt.moves",
        "Drive several moves in a row, each from rest to rest.",
        Param("moves", "list", "as 'line 0.5', 'bend 0.2 90', 'bend 0.2 90 right back'"),
        _POWER,
        _FEEDBACK,
        _COMPENSATE,
        *_SEEKING,
    ),
    Method("nxt.battery", "Read a brick's battery.", (_BRICK,), "brick, battery_v, low, refused", Role.WATCH),
    Method(
        "nxt.info",
        "Ask a brick who it is.",
        (_BRICK,),
        "brick, name, address, firmware, protocol, free_flash_bytes, sleep_limit_s, state",
        Role.WATCH,
    ),
)
