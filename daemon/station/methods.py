"""The methods that the station carries out by itself, as data: what the link checks requests against."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any, Final

from daemon.api.parameters import Method, Param, Role
from daemon.station import paths, recording, runs
from daemon.station.faults import fault_kinds
from daemon.station.objects import code_readings, device_objects
from daemon.station.robots import Robot

PREFIX: Final = "station."
"""What the names of these methods begin with."""

Function = Callable[[Robot, dict[str, Any]], Awaitable[dict[str, Any]]]
"""Carries a method out: given the robot and the validated parameters, it returns the result. Raises CanhelmError."""


async def _objects(robot: Robot, params: dict[str, Any]) -> dict[str, Any]:
    return device_objects(params["device"])


async def _explain(robot: Robot, params: dict[str, Any]) -> dict[str, Any]:
    return code_readings(params["code"], params["kind"])


async def _fault_kinds(robot: Robot, params: dict[str, Any]) -> dict[str, Any]:
    return fault_kinds()


_NAME = Param("name", "string", "of the path")
_HERE = Param("here", "object", "where the vehicle is, as the start of a path: x_m, y_m, heading_deg", default=None)

_METHODS: Final[tuple[tuple[Method, Function], ...]] = (
    (Method("station.paths", "The paths that are kept.", (), "paths", Role.WATCH), paths.list_paths),
    (Method("station.path.read", "One of them.", (_NAME, _HERE), "path", Role.WATCH), paths.read_path),
    (
        Method(
            "station.path.parse",
            "The path in a path file that the page has.",
            (Param("file", "string", "its name, for mistakes"), Param("lines", "list", "of YAML or JSON"), _HERE),
            "path",
            Role.WATCH,
        ),
        paths.parse_path,
    ),
    (
        Method(
            "station.path.write",
            "Keep a path.",
            (
                _NAME,
                Param("path", "object", "start and pieces, as in a path file"),
                Param("replace", "boolean", "also where there is one of this name", default=False),
            ),
            "name",
        ),
        paths.write_path,
    ),
    (Method("station.path.delete", "Delete a path for good.", (_NAME,), "name"), paths.delete_path),
    (
        Method("station.record", "Whether the way of the vehicle is noted.", (), "recording, poses", Role.WATCH),
        recording.look,
    ),
    (Method("station.record.start", "Note where the vehicle goes.", (), "recording"), recording.start),
    (
        Method(
            "station.record.stop",
            "End that; the driven path as lines and arcs.",
            (Param("keep", "boolean", "keep it as a path, too", default=False),),
            "path, length_m, pieces",
        ),
        recording.stop,
    ),
    (Method("station.runs", "What motions and faults have left.", (), "runs", Role.WATCH), runs.list_runs),
    (
        Method(
            "station.objects",
            "The objects of a kind of device.",
            (Param("device", "string", "as status tells it of a node"),),
            "objects",
            Role.WATCH,
        ),
        _objects,
    ),
    (
        Method(
            "station.explain",
            "What a code of a device means.",
            (
                Param("code", "string", "as people write it: 0x1140"),
                Param("kind", "string", "statusword, emcy, abort, or another kind of canhelm explain"),
            ),
            "readings",
            Role.WATCH,
        ),
        _explain,
    ),
    (Method("station.fault_kinds", "Faults of a simulated network.", (), "kinds, fields", Role.WATCH), _fault_kinds),
)

METHODS: Final = {method.name: (method, function) for method, function in _METHODS}
"""Each method with its function, by its name."""
