"""The demo of the Turtle: the simulations of its report's chapter 7 driven over the simulated bus, and a patch of ice.

The report imposes an error on the accelerations of a run without traction control, whatever the controller does then.
So here: that run is computed, its accelerations are what the published controller detects slip by, and the simulated
robot follows the reference that comes out. On ice the loop is closed through the robot's own accelerometer.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import msgspec

from canhelm.errors import UsageError
from daemon.demo_robot import DemoRobot
from daemon.loops.accelerometer import Vector
from daemon.loops.omni_guide import Felt, PublishedGuide, Signals
from daemon.loops.planner import PlanarLimits, PlanarState, Result
from daemon.runtime.handlers import run_motion
from daemon.runtime.omni_motions import OmniMotion
from daemon.runtime.omni_vehicle import OmniVehicle
from drivers.simulated.omni import OmniWorld
from profiles.schema import FloorPatch, OmniGeometry, Profile

GROUP = "turtle"
"""Name of all figures together."""
THRESHOLD_M_S2 = 0.1
LONGEST_S = 30.0


@dataclass(frozen=True, slots=True)
class ImposedError:
    """A factor on the accelerations that are taken for measured ones, for a time."""

    begin_s: float
    end_s: float
    factor: float

    def at(self, time_s: float) -> float:
        """The factor at a time."""
        return self.factor if self.begin_s <= time_s < self.end_s else 1.0


@dataclass(frozen=True, slots=True)
class TurtleFigure:
    """One simulation.

    Attributes:
        identity: number of the report's figure, or a name.
        words: what happens.
        goal_m: where to drive.
        speed_m_s, acceleration_m_s2: limits.
        error: imposed; None where there is none.
        published: what the report says.
        ice: a patch of ice; None: the floor grips.
        traction: by the time-optimal planner with or without the traction loop; None: all as published.
    """

    identity: str
    words: str
    goal_m: Vector
    speed_m_s: float
    acceleration_m_s2: float
    error: ImposedError | None = None
    published: dict[str, Any] = field(default_factory=dict)
    ice: FloorPatch | None = None
    traction: bool | None = None


ICE = FloorPatch(x_m=0.55, y_m=-0.35, length_m=0.7, width_m=0.7, friction=0.03)
"""Under the right half of the robot while it speeds up."""
FIGURES = (
    TurtleFigure("7.3", "no error, x", (2.0, 0.0), 1.0, 1.0, None, {"least_safety_factor": 1.0}),
    TurtleFigure(
        "7.4", "imposed error, x", (2.0, 0.0), 1.0, 1.0, ImposedError(0.3, 0.6, 1.5), {"least_safety_factor": 0.1}
    ),
    TurtleFigure(
        "7.6",
        "imposed error, x and y",
        (2.0, 1.0),
        1.0,
        1.0,
        ImposedError(0.3, 0.8, 1.5),
        {"least_safety_factor": 0.1, "acceleration_in_error_m_s2": 0.1},
    ),
    TurtleFigure(
        "7.7",
        "imposed error at maximal velocity",
        (1.0, 0.0),
        0.5,
        1.0,
        ImposedError(1.4, 2.2, 1.5),
        {"top_speed_from_s": 0.5, "top_speed_to_s": 2.0},
    ),
    TurtleFigure("ice-off", "ice, without traction loop", (2.0, 0.0), 1.2, 1.2, ice=ICE, traction=False),
    TurtleFigure("ice-on", "ice, with traction loop", (2.0, 0.0), 1.2, 1.2, ice=ICE, traction=True),
)


@dataclass(slots=True)
class TurtleTrack:
    """What happened in one figure, a row a control cycle (SI, fixed frame).

    Attributes:
        time_s: since the motion's begin.
        acceleration: of the reference.
        measured: of the robot's centre, by its accelerometer.
        safety_factor: in force.
        case: of the planner.
        velocity: true one of the robot's centre.
        pose: true one.
        error: factor imposed on what is taken for measured.
        slip: detected, in any direction.
        sliding: true: how many wheels slide.
    """

    time_s: list[float] = field(default_factory=list)
    acceleration: list[Vector] = field(default_factory=list)
    measured: list[Vector] = field(default_factory=list)
    safety_factor: list[float] = field(default_factory=list)
    case: list[str] = field(default_factory=list)
    velocity: list[Vector] = field(default_factory=list)
    pose: list[tuple[float, float, float]] = field(default_factory=list)
    error: list[float] = field(default_factory=list)
    slip: list[bool] = field(default_factory=list)
    sliding: list[int] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class TurtleResult:
    """One driven figure: the numbers of ``--json``, and the track for pictures."""

    figure: TurtleFigure
    numbers: dict[str, Any]
    track: TurtleTrack


def imposed_signals(figure: TurtleFigure, limits: PlanarLimits, dt: float) -> Signals:
    """Accelerations of a run without traction control, one step late; the measured ones with the error on them."""
    guide = PublishedGuide(_goal(figure), limits, dt, lambda _: ((0.0, 0.0), (0.0, 0.0)), math.inf)
    state, accelerations, over = PlanarState(), [(0.0, 0.0)], False
    while not over and len(accelerations) * dt < LONGEST_S:
        step = guide.step(state, Felt(), (0.0, 0.0), dt)
        state, over = step.next, step.result is Result.ARRIVED
        accelerations.append(step.acceleration_m_s2)

    def signals(time_s: float) -> tuple[Vector, Vector]:
        index = round(time_s / dt)
        x, y = accelerations[index] if index < len(accelerations) else (0.0, 0.0)
        factor = figure.error.at(time_s) if figure.error else 1.0
        return (factor * x, factor * y), (x, y)

    return signals


async def drive(
    profile: Profile,
    figure: TurtleFigure,
    seed: int,
    record: Path | None,
    tell: Callable[[str], None],
) -> TurtleResult:
    """Boot a robot of its own for one figure, drive it, go down. Raises CanhelmError leaves where the robot fails.

    Args:
        profile: a robot on omni-wheels with simulation data.
        figure: what to drive.
        seed: of everything random in the simulated network.
        record: folder for the candump log, or None.
        tell: called with a sentence at each step.
    """
    if not isinstance(profile.vehicle, OmniGeometry) or profile.simulation is None:
        raise UsageError(f"profile {profile.name} has no omni-wheels to simulate", remedy="leave --profile out")
    floor = {**profile.simulation.floor, "ice": figure.ice} if figure.ice else profile.simulation.floor
    profile = msgspec.structs.replace(profile, simulation=msgspec.structs.replace(profile.simulation, floor=floor))
    robot = DemoRobot(profile, seed, record, tell)
    await robot.app.start()
    try:
        await robot.boot(f"{len(profile.drives)} drives")
        return await _drive(robot, figure)
    finally:
        await robot.app.close()


async def _drive(robot: DemoRobot, figure: TurtleFigure) -> TurtleResult:
    app, before, begin_s = robot.app, robot.counts(), asyncio.get_running_loop().time()
    vehicle = app.vehicle
    assert isinstance(vehicle, OmniVehicle)
    limits = replace(vehicle.limits, speed=figure.speed_m_s, acceleration=figure.acceleration_m_s2)
    published = figure.traction is None
    vehicle.senses.observing = bool(figure.traction)
    signals = imposed_signals(figure, limits, app.cycle.period_s) if published else None
    motion = vehicle.to_goal(
        _goal(figure), limits, None, published=published, signals=signals, threshold_m_s2=THRESHOLD_M_S2
    )
    track = TurtleTrack()
    observer = _observer(robot, motion, figure, track)
    app.supervisor.observers.append(observer)
    robot.tell(f"figure {figure.identity}: {figure.words}")
    try:
        result = await run_motion(app.supervisor, motion, {})
    finally:
        app.supervisor.observers.remove(observer)
    frames, cycles, late, busy_s = (now - then for now, then in zip(robot.counts(), before, strict=True))
    numbers = {
        "figure": figure.identity,
        "move": figure.words,
        "commanded": {
            "end_x_m": figure.goal_m[0],
            "end_y_m": figure.goal_m[1],
            "speed_m_s": figure.speed_m_s,
            "acceleration_m_s2": figure.acceleration_m_s2,
        },
        "achieved": _achieved(figure, track, result),
        "published": figure.published,
        "frames": frames,
        "bus_load": round(busy_s / (asyncio.get_running_loop().time() - begin_s), 4),
        "cycles": cycles,
        "late_cycles": late,
    }
    if app.recorder is not None:
        numbers["log"] = str(app.recorder.path)
    return TurtleResult(figure, numbers, track)


def _goal(figure: TurtleFigure) -> PlanarState:
    return PlanarState(figure.goal_m[0], figure.goal_m[1])


def _observer(robot: DemoRobot, motion: OmniMotion, figure: TurtleFigure, track: TurtleTrack) -> Callable[[], None]:
    world, loop = robot.world, asyncio.get_running_loop()
    assert isinstance(world, OmniWorld)

    def look() -> None:
        record = motion.record
        if record is None or motion.ended.done():
            return
        time_s, (vx, vy, _), pose = loop.time() - motion.begun_s, world.velocity, world.pose
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        track.time_s.append(time_s)
        track.acceleration.append(record.guidance.acceleration_m_s2)
        track.measured.append(record.felt.acceleration_m_s2 or (math.nan, math.nan))
        track.safety_factor.append(record.guidance.safety_factor)
        track.case.append(record.guidance.case)
        track.velocity.append((cos * vx - sin * vy, sin * vx + cos * vy))
        track.pose.append(pose)
        track.error.append(figure.error.at(time_s) if figure.error else 1.0)
        track.slip.append(any(record.guidance.slip))
        track.sliding.append(sum(world.sliding))

    return look


def _achieved(figure: TurtleFigure, track: TurtleTrack, result: dict[str, Any]) -> dict[str, Any]:
    x, y, yaw = track.pose[-1]
    achieved: dict[str, Any] = {
        "end_x_m": round(x, 4) + 0.0,
        "end_y_m": round(y, 4) + 0.0,
        "heading_deg": round(math.degrees(yaw), 3) + 0.0,
        "duration_s": result["duration_s"],
        "least_safety_factor": round(min(track.safety_factor), 4),
        "largest_acceleration_m_s2": round(max(math.hypot(*a) for a in track.acceleration), 4),
        "sideways_m": round(max(abs(_sideways(figure, pose)) for pose in track.pose), 4),
        "changes_of_factor": sum(a != b for a, b in zip(track.safety_factor, track.safety_factor[1:], strict=False)),
        "slip_detected_s": round(sum(track.slip) * _period(track), 3),
        "sliding_s": round(sum(map(bool, track.sliding)) * _period(track), 3),
    }
    if figure.error is not None:
        settled = [
            math.hypot(*a)
            for time, a in zip(track.time_s, track.acceleration, strict=True)
            if figure.error.begin_s + 0.1 <= time < figure.error.end_s
        ]
        achieved["acceleration_in_error_m_s2"] = round(sum(settled) / len(settled), 4)
    top = [time for time, case in zip(track.time_s, track.case, strict=True) if case.startswith("top_speed")]
    if top:
        achieved |= {"top_speed_from_s": round(top[0], 3), "top_speed_to_s": round(top[-1], 3)}
    return achieved


def _period(track: TurtleTrack) -> float:
    return (track.time_s[-1] - track.time_s[0]) / (len(track.time_s) - 1)


def _sideways(figure: TurtleFigure, pose: tuple[float, float, float]) -> float:
    """Distance from the straight line to the goal."""
    x, y = figure.goal_m
    return (pose[1] * x - pose[0] * y) / math.hypot(x, y)
