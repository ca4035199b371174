"""The demo of the semi-trailer: line and circle backwards, and parking, driven over the simulated bus.

A tracking system as in a laboratory says ten times a second where the truck is, with noise; the angle sensors have
theirs. What was achieved is read from the simulation's truth.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from canhelm.errors import UsageError
from daemon.demo_robot import DemoRobot
from daemon.demo_tracking import tracked
from daemon.loops.odometry import Pose
from daemon.loops.path import Path as Way
from daemon.loops.path import wrap
from daemon.runtime.handlers import run_motion
from daemon.runtime.path_commands import PathRequest
from daemon.runtime.path_motions import FollowedPath, PathMotion
from daemon.runtime.semitrailer_vehicle import SemitrailerVehicle
from drivers.simulated.semitrailer import SemitrailerWorld
from profiles.path_file import PathSpec, PieceSpec, StartSpec, load_path_file
from profiles.schema import Profile
from profiles.steered import SemitrailerGeometry

GROUP = "semitrailer"
"""Name of all figures together."""
BESIDE_M = 0.1
"""So far from the path line and circle begin."""
SETTLED_M = 2.5
"""Way after which an error that was there at the begin counts as settled."""


@dataclass(frozen=True, slots=True)
class Manoeuvre:
    """One figure of the demo.

    Attributes:
        identity: its name.
        words: what happens.
        spec: the path.
        beside_m: the vehicle begins so far to the left of it.
    """

    identity: str
    words: str
    spec: PathSpec
    beside_m: float = 0.0


def line_backwards(length_m: float) -> Manoeuvre:
    """Straight backwards, beginning beside the line."""
    piece = PieceSpec(line_m=length_m, drive="backward")
    return Manoeuvre("line-backwards", f"{length_m:g} m straight backwards", _from_origin(piece), BESIDE_M)


def circle_backwards(turns: float) -> Manoeuvre:
    """Backwards round a circle of 1 m, beginning beside it."""
    piece = PieceSpec(arc_deg=360.0 * turns, radius_m=1.0, drive="backward")
    return Manoeuvre("circle-backwards", f"{turns:g} times round a circle of 1 m", _from_origin(piece), BESIDE_M)


def _from_origin(piece: PieceSpec) -> PathSpec:
    return PathSpec(start=StartSpec(), pieces=[piece])


def figures() -> tuple[Manoeuvre, ...]:
    """All figures of the demo."""
    parking = [
        Manoeuvre(name, spec.description, spec)
        for name in ("park-parallel", "park-perpendicular")
        for spec in (load_path_file(name).spec,)
    ]
    return (line_backwards(5.0), circle_backwards(1.0), *parking)


@dataclass(slots=True)
class Trace:
    """What happened, a row a control cycle (SI); the truth of the simulation.

    Attributes:
        time_s: since the motion's begin.
        truck, trailer: poses of the axles.
        error_m: of the reference unit beside the path, positive to the left.
        heading_error_rad: of the reference unit.
        bending_rad, steering_rad: angles.
        speed_m_s: commanded.
        limits: names of those that were active.
        way_m: driven so far.
    """

    time_s: list[float] = field(default_factory=list)
    truck: list[tuple[float, float, float]] = field(default_factory=list)
    trailer: list[tuple[float, float, float]] = field(default_factory=list)
    error_m: list[float] = field(default_factory=list)
    heading_error_rad: list[float] = field(default_factory=list)
    bending_rad: list[float] = field(default_factory=list)
    steering_rad: list[float] = field(default_factory=list)
    speed_m_s: list[float] = field(default_factory=list)
    limits: list[tuple[str, ...]] = field(default_factory=list)
    way_m: list[float] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class SemitrailerResult:
    """One driven figure: the numbers of ``--json``; vehicle, path and trace for pictures."""

    manoeuvre: Manoeuvre
    geometry: SemitrailerGeometry
    numbers: dict[str, Any]
    path: Way
    trace: Trace


async def drive(
    profile: Profile,
    manoeuvre: Manoeuvre,
    seed: int,
    record: Path | None,
    tell: Callable[[str], None],
    published: bool = False,
) -> SemitrailerResult:
    """Boot a robot of its own for one figure, drive it, go down. Raises CanhelmError leaves where the robot fails.

    Args:
        profile: a semi-trailer with simulation data.
        manoeuvre: what to drive.
        seed: of everything random in the simulated network, and of the tracking system's noise.
        record: folder for the candump log, or None.
        tell: called with a sentence at each step.
        published: by the thesis' law.
    """
    if not isinstance(profile.vehicle, SemitrailerGeometry) or profile.simulation is None:
        raise UsageError(f"profile {profile.name} has no semi-trailer to simulate", remedy="leave --profile out")
    robot = DemoRobot(profile, seed, record, tell)
    vehicle, world = robot.app.vehicle, robot.world
    assert isinstance(vehicle, SemitrailerVehicle)
    assert isinstance(world, SemitrailerWorld)
    _place(vehicle, world, manoeuvre)
    await robot.app.start()
    try:
        await robot.boot("two drives and two encoders")
        with tracked(robot, lambda: world.pose, vehicle.locate, seed):
            return await _drive(robot, vehicle, world, manoeuvre, published)
    finally:
        await robot.app.close()


def _place(vehicle: SemitrailerVehicle, world: SemitrailerWorld, manoeuvre: Manoeuvre) -> None:
    """Straight, with the reference point at the path's begin or beside it."""
    first = manoeuvre.spec.pieces[0]
    ahead = vehicle.kinematics.straight_lead_m if first.drive == "backward" else 0.0
    world.place((ahead, manoeuvre.beside_m, 0.0))
    vehicle.locate(Pose(ahead, manoeuvre.beside_m))


async def _drive(
    robot: DemoRobot, vehicle: SemitrailerVehicle, world: SemitrailerWorld, manoeuvre: Manoeuvre, published: bool
) -> SemitrailerResult:
    before, begin_s = robot.counts(), asyncio.get_running_loop().time()
    law = "published" if published else "cascade"
    plan = await vehicle.plan_path(PathRequest(manoeuvre.spec, law=law))
    motion, trace = plan.motion(None), Trace()
    look = _observer(world, plan, motion, trace)
    robot.app.supervisor.observers.append(look)
    robot.tell(f"{manoeuvre.identity}: {manoeuvre.words}")
    try:
        result = await run_motion(robot.app.supervisor, motion, {})
    finally:
        robot.app.supervisor.observers.remove(look)
    frames, cycles, late, busy_s = (now - then for now, then in zip(robot.counts(), before, strict=True))
    numbers = {
        "figure": manoeuvre.identity,
        "move": manoeuvre.words,
        "law": law,
        "achieved": achieved(plan.path, trace, result),
        "limits_s": result["limits_s"],
        "frames": frames,
        "bus_load": round(busy_s / (asyncio.get_running_loop().time() - begin_s), 4),
        "cycles": cycles,
        "late_cycles": late,
    }
    return SemitrailerResult(manoeuvre, vehicle.geometry, numbers, plan.path, trace)


def _observer(world: SemitrailerWorld, plan: FollowedPath, motion: PathMotion, trace: Trace) -> Callable[[], None]:
    loop = asyncio.get_running_loop()

    def look() -> None:
        record = motion.record
        if record is None or motion.ended.done():
            return
        truck, trailer, meeting = world.pose, world.trailer_pose, record.following.meeting
        piece = plan.path.pieces[meeting.piece]
        unit = trailer if piece.backward else truck
        along, offset = piece.project(unit[0], unit[1], meeting.along_m)
        way = trace.way_m[-1] if trace.way_m else 0.0
        step_s = loop.time() - motion.begun_s - trace.time_s[-1] if trace.time_s else 0.0
        trace.time_s.append(loop.time() - motion.begun_s)
        trace.truck.append(truck)
        trace.trailer.append(trailer)
        trace.error_m.append(-offset if piece.backward else offset)
        trace.heading_error_rad.append(wrap(unit[2] - piece.heading(along)))
        trace.bending_rad.append(world.bending_rad)
        trace.steering_rad.append(world.steering.angle_rad)
        trace.speed_m_s.append(record.speed_m_s)
        trace.limits.append(motion.limits_active)
        trace.way_m.append(way + abs(record.speed_m_s) * step_s)

    return look


def achieved(path: Way, trace: Trace, result: dict[str, Any]) -> dict[str, Any]:
    """What the truth says of a drive: its end, and errors once what was there at the begin has settled."""
    last, truck = path.pieces[-1], trace.truck[-1]
    unit = trace.trailer[-1] if last.backward else truck
    end = last.point(last.length_m)
    turned = wrap(unit[2] - last.heading(last.length_m))
    settled = [abs(error) for error, way in zip(trace.error_m, trace.way_m, strict=True) if way > SETTLED_M]
    return {
        "end_error_m": round(math.dist(end, unit[:2]), 4),
        "end_heading_error_deg": round(math.degrees(turned), 2),
        "end_bending_deg": round(math.degrees(trace.bending_rad[-1]), 2),
        "largest_error_m": round(max(map(abs, trace.error_m)), 4),
        "settled_error_m": round(max(settled), 4) if settled else None,
        "largest_bending_deg": round(math.degrees(max(map(abs, trace.bending_rad))), 1),
        "way_m": round(trace.way_m[-1], 3),
        "duration_s": result["duration_s"],
    }
