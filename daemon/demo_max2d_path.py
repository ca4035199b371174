"""The demo of the MAX2D on a path: it cannot steer while it rolls, so it drives in pieces, stops, steers and drives on.

The path has what the planner has to choose between: a line and a bend that are driven as they are, a bend too narrow to
be steered, and a line and a bend after it on which the body stands askew to the way.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from canhelm.errors import UsageError
from daemon.demo_robot import DemoRobot
from daemon.loops.paired_steer_piece import DrivenPiece
from daemon.loops.path import Path as Way
from daemon.loops.path_in_pieces import distance
from daemon.runtime.handlers import run_motion
from daemon.runtime.paired_steer_vehicle import PairedSteerVehicle
from daemon.runtime.path_commands import PathRequest
from profiles.path_file import PathSpec, PieceSpec
from profiles.schema import PairedSteerGeometry, Profile

FIGURE: Final = "path-in-pieces"
SPEED_M_S: Final = 0.5
PATH: Final = PathSpec(
    pieces=[
        PieceSpec(line_m=0.8),
        PieceSpec(arc_deg=90, radius_m=0.8),
        PieceSpec(line_m=0.4),
        PieceSpec(arc_deg=-45, radius_m=0.25),
        PieceSpec(line_m=0.6),
        PieceSpec(arc_deg=-60, radius_m=1.2),
    ]
)


@dataclass(slots=True)
class PathTrack:
    """What happened, a row a control cycle.

    Attributes:
        piece: under way.
        pose: true one of the robot's centre.
    """

    piece: list[int] = field(default_factory=list)
    pose: list[tuple[float, float, float]] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class PathResult:
    """The numbers of ``--json``; path, plan and track for pictures."""

    numbers: dict[str, Any]
    way: Way
    pieces: list[DrivenPiece]
    track: PathTrack


async def drive(profile: Profile, seed: int, record: Path | None, tell: Callable[[str], None]) -> PathResult:
    """Boot a robot, drive the path, go down. Raises CanhelmError leaves where the robot fails.

    Args:
        profile: a robot with paired steering and simulation data.
        seed: of everything random in the simulated network.
        record: folder for the candump log, or None.
        tell: called with a sentence at each stage.
    """
    if not isinstance(profile.vehicle, PairedSteerGeometry) or profile.simulation is None:
        raise UsageError(f"profile {profile.name} has no paired steering to simulate", remedy="leave --profile out")
    robot = DemoRobot(profile, seed, record, tell)
    await robot.app.start()
    try:
        await robot.boot("four drives and two encoders")
        return await _drive(robot)
    finally:
        await robot.app.close()


async def _drive(robot: DemoRobot) -> PathResult:
    vehicle, before, begin_s = robot.app.vehicle, robot.counts(), asyncio.get_running_loop().time()
    assert isinstance(vehicle, PairedSteerVehicle)
    plan = await vehicle.plan_path(PathRequest(PATH, speed_m_s=SPEED_M_S))
    motion, track = plan.motion(None), PathTrack()
    robot.tell(
        f"{FIGURE}: {plan.summary()['stops']} stops, at most {plan.summary()['deviation_m']:g} m beside the path"
    )

    def look() -> None:
        if motion.running and not motion.ended.done():
            track.piece.append(motion.number)
            track.pose.append(robot.world.pose)

    robot.app.supervisor.observers.append(look)
    result = await run_motion(robot.app.supervisor, motion, {})
    frames, cycles, late, busy_s = (now - then for now, then in zip(robot.counts(), before, strict=True))
    pieces = _with_truth(plan.way, plan.pieces, track, result["pieces"])
    end = plan.pieces[-1].end
    numbers = {
        "figure": FIGURE,
        "stops": result["stops"],
        "length_m": result["length_m"],
        "duration_s": result["duration_s"],
        "deviation_m": result["deviation_m"],
        "driven_deviation_m": result["driven_deviation_m"],
        "true_deviation_m": max(piece["true_deviation_m"] for piece in pieces),
        "true_end_error_m": round(math.dist((end.x_m, end.y_m), track.pose[-1][:2]), 4),
        "pieces": pieces,
        "frames": frames,
        "bus_load": round(busy_s / (asyncio.get_running_loop().time() - begin_s), 4),
        "cycles": cycles,
        "late_cycles": late,
    }
    return PathResult(numbers, plan.way, plan.pieces, track)


def _with_truth(
    way: Way, pieces: list[DrivenPiece], track: PathTrack, told: list[dict[str, Any]]
) -> list[dict[str, Any]]:
    """What is told of each piece, and how far beside the path the simulation saw the robot on it."""
    off = [0.0] * len(pieces)
    for number, (x, y, _) in zip(track.piece, track.pose, strict=True):
        stretch = way.pieces[pieces[number].first : pieces[number].last + 1]
        off[number] = max(off[number], min(distance(one, (x, y)) for one in stretch))
    return [{**one, "true_deviation_m": round(true, 4)} for one, true in zip(told, off, strict=True)]
