"""Notes where a robot is driven, whoever drives it, and makes a path of it; it goes on while pages come and go."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping
from contextlib import aclosing
from datetime import UTC, datetime
from typing import Any, Final

import msgspec

from canhelm.aio import Client
from canhelm.errors import CanhelmError, DaemonNotRunning, LimitExceeded, Refused, UsageError
from daemon.loops.odometry import Pose
from daemon.loops.path import wrap
from daemon.loops.path_fitting import SPACING_M
from daemon.loops.recorded_path import RecordedPath, fit_record
from daemon.station import paths
from daemon.station.robots import Robot

RATE_HZ: Final = 10.0
TOLERANCE_M: Final = 0.01
"""What the path may be off what was driven, as of `canhelm drive fit`."""
SLIGHTEST_TURN_RAD: Final = math.radians(1.0)
MAX_POSES: Final = 20_000
"""Noted every centimetre at most: 200 m."""
_UNDER_WAY: Final[dict[str, Recording]] = {}


class Recording:
    """Where one robot goes, from now on.

    Args:
        robot: which one.

    Attributes:
        poses: of the body, and of the trailer, or the body again where there is none.
        trouble: why nothing more is noted; None while it goes on.
    """

    def __init__(self, robot: Robot) -> None:
        self.poses: list[tuple[Pose, Pose]] = []
        self.trouble: CanhelmError | None = None
        self._robot = robot
        self._client = Client(robot.socket)
        self._beginning = asyncio.Lock()
        self._task: asyncio.Task[None] | None = None

    async def begin(self) -> None:
        """Connect to the daemon. Raises CanhelmError; Refused where the vehicle does not know where it is."""
        async with self._beginning:
            await self._client.connect()
            try:
                self.note((await self._client.status())["vehicle"])
            except BaseException:
                await self._client.close()
                raise
            self._task = asyncio.create_task(self._listen(), name=f"recording of {self._robot.name}")

    async def end(self) -> None:
        """Note nothing more."""
        async with self._beginning:
            if self._task is not None:
                self._task.cancel()
                await asyncio.wait([self._task])
                await self._client.close()

    async def _listen(self) -> None:
        try:
            async with aclosing(self._client.notifications(RATE_HZ)) as notifications:
                async for kind, status in notifications:
                    if kind == "status":
                        self.note(status["vehicle"])
        except CanhelmError as error:
            self.trouble = error

    def note(self, vehicle: Mapping[str, Any]) -> None:
        """Take where it is, unless it is there still. Raises Refused where it does not know that."""
        pose = vehicle.get("pose")
        if pose is None:
            raise Refused("this vehicle does not know where it is", remedy="record one that has an odometry")
        body = _pose(pose)
        if self.poses and not _apart(self.poses[-1][0], body):
            return
        if len(self.poses) >= MAX_POSES:
            what = "the recorded way is as long as one may be"
            self.trouble = LimitExceeded(what, limit=MAX_POSES, remedy="record in parts")
            return
        trailer = vehicle.get("trailer")
        self.poses.append((body, _pose(trailer) if trailer else body))


async def start(robot: Robot, params: dict[str, Any]) -> dict[str, Any]:
    """Note where the vehicle goes; a recording that is under way already goes on. Raises CanhelmError."""
    recording = _UNDER_WAY.get(robot.name)
    if recording is None:
        recording = _UNDER_WAY[robot.name] = Recording(robot)
        try:
            await recording.begin()
        except BaseException:
            _UNDER_WAY.pop(robot.name, None)
            raise
    return {"recording": True, "poses": len(recording.poses)}


async def look(robot: Robot, params: dict[str, Any]) -> dict[str, Any]:
    """Whether the way is being noted: a page that comes back goes on with it."""
    recording = _UNDER_WAY.get(robot.name)
    return {"recording": recording is not None, "poses": len(recording.poses) if recording else 0}


async def stop(robot: Robot, params: dict[str, Any]) -> dict[str, Any]:
    """End it; the driven path as lines and arcs, kept under a name of its own where that is asked for.

    Raises:
        Refused: nothing is being recorded.
        DaemonNotRunning: the daemon was lost before the vehicle moved.
        UsageError: the vehicle hardly moved.
        LimitExceeded, NotReady: the path cannot be kept.
    """
    recording = _UNDER_WAY.pop(robot.name, None)
    if recording is None:
        raise Refused("nothing is being recorded", remedy="begin a recording first")
    await recording.end()
    path = await asyncio.to_thread(_fitted, recording)
    spec = msgspec.to_builtins(path.spec())
    name = {}
    if params["keep"]:
        name = {"name": datetime.now(UTC).strftime("recorded-%Y%m%d-%H%M%S")}
        await paths.write_path(robot, {**name, "path": spec, "replace": False})
    trouble = recording.trouble.message if recording.trouble else ""
    return {"path": spec, "length_m": round(path.length_m, 3), "pieces": len(path.pieces), "trouble": trouble, **name}


def _fitted(recording: Recording) -> RecordedPath:
    bodies, trailers = [body for body, _ in recording.poses], [trailer for _, trailer in recording.poses]
    path = fit_record(bodies, trailers, TOLERANCE_M)
    if path is not None:
        return path
    if isinstance(recording.trouble, DaemonNotRunning):
        raise recording.trouble
    raise UsageError("the vehicle hardly moved", remedy="record while it drives")


def _pose(told: Mapping[str, float]) -> Pose:
    return Pose(told["x_m"], told["y_m"], math.radians(told["yaw_deg"]))


def _apart(one: Pose, other: Pose) -> bool:
    moved = math.hypot(one.x_m - other.x_m, one.y_m - other.y_m)
    return moved >= SPACING_M / 2 or abs(wrap(one.yaw_rad - other.yaw_rad)) >= SLIGHTEST_TURN_RAD
