"""The methods ``vehicle.shape`` and ``path.active``: what a map shows of a vehicle and of the path that it follows."""

from __future__ import annotations

import math
from typing import Any, Final

from daemon.loops.path import Path, Piece, wrap
from daemon.runtime.handlers import Handler, Params
from daemon.runtime.path_commands import PathVehicle
from daemon.runtime.shapes import shape_of
from daemon.runtime.supervisor import Supervisor
from daemon.runtime.vehicle_view import followed
from profiles.schema import Geometry
from profiles.steered import CarGeometry, SemitrailerGeometry

MAX_SHOWN: Final = 2000
"""Pieces in one answer; a path may have more."""
SLIGHTEST_RAD: Final = 1e-6
"""An arc that turns less is told as a line."""
ANY_DIRECTION_DEG: Final = 180.0


class LookCommands:
    """Handlers, by name in :attr:`handlers`.

    Args:
        supervisor: of the vehicle.
        simulated: whether the network is.
    """

    def __init__(self, supervisor: Supervisor, *, simulated: bool) -> None:
        self._supervisor, self._simulated = supervisor, simulated
        self.handlers: dict[str, Handler] = {"vehicle.shape": self._shape, "path.active": self._active}

    async def _shape(self, params: Params, lease: str | None) -> dict[str, Any]:
        vehicle = self._supervisor.vehicle
        profile = vehicle.profile
        marks = profile.localisation.reflectors if profile.localisation else {}
        return {
            "type": profile.vehicle.type if profile.vehicle else None,
            **shape_of(profile).told(),
            "steering": _steering_drive(profile.vehicle),
            "limits": self._limits(),
            "stream": self._stream(),
            "path": self._path(),
            "reflectors": [{"name": name, "x_m": mark.x_m, "y_m": mark.y_m} for name, mark in marks.items()],
            "simulated": self._simulated,
        }

    def _limits(self) -> dict[str, float | None]:
        """What may be asked for; ``backward_m_s`` is 0 for a vehicle without a reverse gear."""
        vehicle = self._supervisor.vehicle
        sticks, geometry, speed = vehicle.sticks(), vehicle.profile.vehicle, vehicle.profile.limits.speed_m_s
        direction = ANY_DIRECTION_DEG if "sideways" in sticks else _end(sticks.get("direction"))
        return {
            "speed_m_s": speed,
            "backward_m_s": -sticks["speed"][0] if sticks else speed,
            "yaw_rate_deg_s": _end(sticks.get("yaw_rate")),
            "steering_deg": _end(sticks.get("steering")),
            "direction_deg": direction,
            "bending_deg": geometry.trailer.max_bending_deg if isinstance(geometry, SemitrailerGeometry) else None,
        }

    def _stream(self) -> dict[str, bool] | None:
        """Parameters of ``drive.set`` that make sense; None without that method."""
        vehicle = self._supervisor.vehicle
        if "drive.set" not in vehicle.methods:
            return None
        sticks = vehicle.sticks().keys()
        return {
            "direction": bool(sticks & {"direction", "sideways"}),
            "yaw_rate": "yaw_rate" in sticks,
            "steering": "steering" in sticks,
        }

    def _path(self) -> dict[str, float | None] | None:
        vehicle = self._supervisor.vehicle
        if not isinstance(vehicle, PathVehicle):
            return None
        forward, backward = (vehicle.smallest_radius_m(backward=way) for way in (False, True))
        return {
            "smallest_radius_m": _rounded_up(forward),
            "smallest_radius_backward_m": _rounded_up(backward),
            "lead_m": _lead_m(vehicle.profile.vehicle),
        }

    async def _active(self, params: Params, lease: str | None) -> dict[str, Any]:
        motion = followed(self._supervisor.motions.values())
        if motion is None or motion.path is None:
            return {"motion": None, "path": None, "pieces": 0}
        return {"motion": motion.identity, "path": told(motion.path), "pieces": len(motion.path.pieces)}


def told(path: Path) -> dict[str, Any]:
    """A path as a path file has it, each piece with its beginning; of a very long one the first ``MAX_SHOWN`` pieces.

    Waypoints are told as the lines and arcs that were made of them, and driving directions as they are driven.
    """
    first = path.pieces[0]
    heading_deg = round(math.degrees(wrap(first.heading(0.0))), 4) + 0.0
    start = {"x_m": round(first.x_m, 5), "y_m": round(first.y_m, 5), "heading_deg": heading_deg}
    return {"start": start, "pieces": [_told(piece) for piece in path.pieces[:MAX_SHOWN]]}


def _told(piece: Piece) -> dict[str, Any]:
    where = {
        "from_m": [round(piece.x_m, 5), round(piece.y_m, 5)],
        "drive": "backward" if piece.backward else "forward",
    }
    turn = piece.curvature * piece.length_m
    if abs(turn) < SLIGHTEST_RAD:
        return {**where, "line_m": round(piece.length_m, 5)}
    return {**where, "arc_deg": round(math.degrees(turn), 5), "radius_m": round(1 / abs(piece.curvature), 5)}


def _lead_m(geometry: object) -> float:
    """From the reference point for driving backward ahead to the one for driving forward, the vehicle straight [m]."""
    if not isinstance(geometry, SemitrailerGeometry):
        return 0.0
    return round(geometry.hitch_offset_m + geometry.trailer.length_m, 6)


def _end(stick: tuple[float, float] | None) -> float | None:
    return None if stick is None else round(stick[1], 6)


def _steering_drive(geometry: Geometry | None) -> str | None:
    """Name of the drive that turns a steered axle, and rolls no wheel; None where there is none."""
    return geometry.steering.drive if isinstance(geometry, CarGeometry | SemitrailerGeometry) else None


def _rounded_up(radius_m: float | None) -> float | None:
    return None if radius_m is None else math.ceil(radius_m * 1000) / 1000
