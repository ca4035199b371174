"""Runs on the simulated CAN network: the whole daemon drives the robot ``semitrailer_lab`` among its reflectors.

Drives, encoders and scanner have their twins' faults; the daemon steers by what it measures. Errors are those of the
simulation's truth.
"""

from __future__ import annotations

import asyncio
import math
import zlib
from typing import Final

from msgspec.structs import astuple, replace

from canhelm.errors import CanhelmError
from daemon.campaigns.cases import DURATION_S, PERIOD_S, SPEED_M_S, Case, Outcome
from daemon.campaigns.following_runs import PATHS, Run, errors_of, outcome, outside_sign
from daemon.campaigns.ideal_semitrailer import placed
from daemon.demo_robot import DemoRobot
from daemon.loops.odometry import Pose
from daemon.loops.path import Meeting, Path, Piece
from daemon.loops.path_driving import Phase
from daemon.loops.path_following import errors_on
from daemon.loops.path_speed import SpeedTuning
from daemon.runtime.clock import run_virtual
from daemon.runtime.handlers import run_motion
from daemon.runtime.path_motions import FollowedPath, PathMotion
from daemon.runtime.semitrailer_vehicle import SemitrailerVehicle
from drivers.simulated.semitrailer import SemitrailerWorld
from profiles.loader import load

ROBOT: Final = "semitrailer_lab"
LINE_BEGIN_M: Final = 2.0
"""Where the line begins, so that its 4 m lie between the reflectors."""
FARTHEST_M: Final = 100.0
"""Length of the path; no run comes to its end."""
ACCELERATION_M_S2: Final = 0.3
LATERAL_M_S2: Final = 0.3


def can_outcome(case: Case) -> Outcome:
    """Drive a case on the simulated network, on virtual time; what ended it early is told in the outcome."""
    run = Run()
    ended = run_virtual(_drive(case, run))
    run.settle_on_path()
    if ended:
        run.settle_m = None
    return outcome(run, ended or "driven")


async def _drive(case: Case, run: Run) -> str:
    """Fill in the run; why it ended early, or ""."""
    piece = _piece(case)
    robot = DemoRobot(load(ROBOT).profile, zlib.crc32(repr(case).encode()), None, lambda _: None)
    vehicle, world = robot.app.vehicle, robot.world
    assert isinstance(vehicle, SemitrailerVehicle)
    assert isinstance(world, SemitrailerWorld)
    start = placed(piece, errors_of(case))
    x_m, y_m, yaw_rad = astuple(start.truck)
    world.place((x_m, y_m, yaw_rad), start.bending_rad, start.steering_rad)
    vehicle.locate(start.truck)
    await robot.app.start()
    try:
        await robot.boot("the semi-trailer")
        tuning = SpeedTuning(SPEED_M_S, ACCELERATION_M_S2, LATERAL_M_S2)
        motion = FollowedPath(vehicle, Path([piece]), tuning, published=case.law == "thesis").motion(None)
        watch = _Watch(motion, piece, vehicle, world, run)
        robot.app.supervisor.observers.append(watch.look)
        await run_motion(robot.app.supervisor, motion, {})
    except CanhelmError as error:
        return "" if watch.arrived else error.message
    finally:
        await robot.app.close()
    return ""


def _piece(case: Case) -> Piece:
    piece = replace(PATHS[case.path], length_m=FARTHEST_M)
    return replace(piece, x_m=LINE_BEGIN_M) if case.path == "line" else piece


class _Watch:
    """Looks at the truth once a control cycle, keeps a row every ``PERIOD_S``, and ends the run after its way.

    Attributes:
        arrived: the way was driven to its end.
    """

    def __init__(
        self, motion: PathMotion, piece: Piece, vehicle: SemitrailerVehicle, world: SemitrailerWorld, run: Run
    ) -> None:
        self.arrived = False
        self._motion, self._piece, self._vehicle, self._world, self._run = motion, piece, vehicle, world, run
        self._sign, self._along_m, self._way_m = outside_sign(piece), 0.0, 0.0
        self._last, self._due_s = world.pose, -math.inf

    def look(self) -> None:
        """One control cycle."""
        record, now_s = self._motion.record, asyncio.get_running_loop().time()
        if record is None or record.phase is not Phase.DRIVING:
            return
        x, y, _ = self._world.pose
        self._way_m += math.dist((x, y), self._last[:2])
        self._last = self._world.pose
        if now_s >= self._due_s:
            self._due_s = max(self._due_s, now_s) + PERIOD_S
            self._keep(record.steering_rad)
        if self._way_m >= DURATION_S * SPEED_M_S and not self._motion.stop_reason:
            self.arrived = True
            self._motion.stop("the run is over")

    def _keep(self, steering_rad: float) -> None:
        trailer = Pose(*self._world.trailer_pose)
        self._along_m, offset = self._piece.project(trailer.x_m, trailer.y_m, self._along_m)
        hitch = self._vehicle.kinematics.hitches[0]
        meeting = Meeting(0, self._along_m, offset)
        errors = errors_on(self._piece, meeting, trailer, self._world.bending_rad, hitch)
        shown = (self._sign * errors.position_m, errors.heading_rad, errors.bending_rad or 0.0)
        self._run.add(round(self._way_m, 4), shown, steering_rad)
