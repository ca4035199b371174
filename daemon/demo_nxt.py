"""The demo of the NXT robot: its report's lines and bends by tacho limits and by feedback, and the report's call.

Each move is driven by a robot of its own, after a little way forward that takes up the play of its gears. What was
achieved is read from the simulation's truth.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from canhelm.errors import UsageError
from daemon.demo_robot import DemoRobot
from daemon.loops.differential import DifferentialDrive, wrap_angle
from daemon.loops.odometry import Pose
from daemon.loops.pose_feedback import REPORT_GAINS, Tolerance
from daemon.loops.published_pose_drive import IdealDrive, ideal_drive
from drivers.simulated.nxt_robot import SimulatedNxtRobot
from profiles.bricks import DifferentialGeometry
from profiles.schema import Profile

GROUP: Final = "nxt"
OBSERVED_TACHO_ERROR_DEG: Final = (20.0, 60.0)
"""By how much wheels missed their angles, as the report saw it."""
TAKE_UP_M: Final = 0.05
CALL_ROBOT: Final = DifferentialDrive(2.8, 5.8)
"""Of the report's call, in centimetres; the radius, where it has the diameter."""
CALL_GOAL: Final = Pose(10.0, 10.0, math.pi / 2)
CALL_TOLERANCE: Final = Tolerance(0.5, 0.2, math.pi / 10)
CALL_STEPS_S: Final = (0.01, 1.0)
CALL_LONGEST_S: Final = 15.0

Row = tuple[float, float, float]
"""Pose: x [m], y [m], yaw [rad]."""


@dataclass(frozen=True, slots=True)
class NxtFigure:
    """One move.

    Attributes:
        words: what is driven.
        method, params: of the API, without feedback.
        end: pose at its end, from the origin.
    """

    words: str
    method: str
    params: dict[str, Any]
    end: Pose


def _line(distance_cm: float) -> NxtFigure:
    way = distance_cm / 100
    return NxtFigure(f"line {distance_cm:g} cm", "nxt.line", {"distance_m": way}, Pose(way))


def _bend(side: str, sign: int) -> NxtFigure:
    params = {"radius_m": 0.2, "angle_deg": 90.0, "side": side}
    return NxtFigure(f"bend {side}, 20 cm, 90 deg", "nxt.bend", params, Pose(0.2, sign * 0.2, sign * math.pi / 2))


FIGURES: Final = (_line(10), _line(50), _line(100), _bend("left", 1), _bend("right", -1))


@dataclass(frozen=True, slots=True)
class NxtRun:
    """One move, driven once.

    Attributes:
        miss: how far from its end it has ended.
        track: true poses from its begin on.
    """

    miss: dict[str, Any]
    track: list[Row]


@dataclass(frozen=True, slots=True)
class NxtResult:
    """One move by tacho limits and by feedback."""

    figure: NxtFigure
    open_loop: NxtRun
    feedback: NxtRun

    @property
    def numbers(self) -> dict[str, Any]:
        """For ``--json``."""
        published = {"tacho_error_deg": list(OBSERVED_TACHO_ERROR_DEG)}
        achieved = {"open_loop": self.open_loop.miss, "feedback": self.feedback.miss}
        return {"figure": self.figure.words, "published": published, **achieved}


@dataclass(frozen=True, slots=True)
class CallResult:
    """The report's call with one length of a step, by ideal motors."""

    dt_s: float
    run: IdealDrive

    @property
    def numbers(self) -> dict[str, Any]:
        """For ``--json``."""
        end = self.run.track[-1]
        return {
            "figure": f"call (10, 10, pi/2), dt {self.dt_s:g} s",
            "published": {"reached": self.dt_s < 1.0},
            "reached": self.run.reached,
            "duration_s": round((len(self.run.track) - self.run.reached) * self.dt_s, 3),
            "end_x_cm": round(end.x_m, 3),
            "end_y_cm": round(end.y_m, 3),
            "end_heading_rad": round(wrap_angle(end.yaw_rad), 3),
        }


def report_calls() -> list[CallResult]:
    """The report's call with its short and its long step."""
    return [
        CallResult(dt, ideal_drive(CALL_ROBOT, CALL_GOAL, CALL_TOLERANCE, REPORT_GAINS, dt, CALL_LONGEST_S))
        for dt in CALL_STEPS_S
    ]


async def drive(profile: Profile, figure: NxtFigure, seed: int, tell: Callable[[str], None]) -> NxtResult:
    """Drive one move twice. Raises UsageError, and CanhelmError leaves where the robot fails.

    Args:
        profile: a robot whose two wheels are at one brick.
        figure: the move.
        seed: of everything random in the simulated robot.
        tell: called with a sentence at each step.
    """
    open_loop = await _run(profile, figure, seed, tell, feedback=False)
    return NxtResult(figure, open_loop, await _run(profile, figure, seed, tell, feedback=True))


async def _run(
    profile: Profile, figure: NxtFigure, seed: int, tell: Callable[[str], None], *, feedback: bool
) -> NxtRun:
    if not isinstance(profile.vehicle, DifferentialGeometry):
        raise UsageError(f"profile {profile.name} has no two wheels at a brick", remedy="leave --profile out")
    robot = DemoRobot(profile, seed, None, tell)
    app, network = robot.app, robot.app.network
    body = next((brick.robot for brick in network.bricks.values() if brick.robot), None) if network else None
    if body is None:
        raise UsageError(f"profile {profile.name} has no two wheels at a brick", remedy="leave --profile out")
    await app.start()
    try:
        await robot.boot("an NXT brick and its two motors", "over simulated Bluetooth")
        await _call(robot, "nxt.goto", {"x_m": TAKE_UP_M, "y_m": 0.0})
        start, track = _pose(body), list[Row]()
        app.supervisor.observers.append(lambda: track.append(_relative(_pose(body), start)))
        tell(f"{figure.words}, {'by feedback' if feedback else 'open loop'}")
        result = await _call(robot, figure.method, {**figure.params, "feedback": feedback})
        track.append(_relative(_pose(body), start))
        return NxtRun(_miss(figure.end, track[-1], result), track)
    finally:
        await app.close()


async def _call(robot: DemoRobot, method: str, params: dict[str, Any]) -> dict[str, Any]:
    """A motion that is handed to the daemon, and waited for."""
    service = robot.app.service
    begun = await service.call(method, {**params, "wait": False}, None)
    return await service.call("motion.wait", {"motion": begun["motion"]}, None)


def _miss(end: Pose, row: Row, result: dict[str, Any]) -> dict[str, Any]:
    miss: dict[str, Any] = {
        "error_cm": round(100 * math.hypot(row[0] - end.x_m, row[1] - end.y_m), 2),
        "heading_error_deg": round(math.degrees(wrap_angle(row[2] - end.yaw_rad)), 2) + 0.0,
        "duration_s": result["duration_s"],
    }
    if "tacho_errors_deg" in result:
        miss["tacho_error_deg"] = list(result["tacho_errors_deg"][-1])
    return miss


def _pose(body: SimulatedNxtRobot) -> Row:
    body.brick.catch_up()
    return body.x_m, body.y_m, body.yaw_rad


def _relative(row: Row, start: Row) -> Row:
    dx, dy, cos, sin = row[0] - start[0], row[1] - start[1], math.cos(start[2]), math.sin(start[2])
    return cos * dx + sin * dy, cos * dy - sin * dx, row[2] - start[2]
