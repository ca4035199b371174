"""A robot on two wheels with a simulated NXT on virtual time: what a vehicle's runtime does, as short as can be."""

from __future__ import annotations

import asyncio
import math
from dataclasses import dataclass

from daemon.loops.differential import DifferentialDrive, Move, TachoCompensation, line, wrap_angle
from daemon.loops.odometry import Pose
from daemon.loops.pose_feedback import AlignedTurns, GearPlay, GoalSeeker, Phase, SeekSettings, Tolerance
from drivers.nxt.brick import Brick, Legs
from drivers.nxt.codes import Output
from drivers.nxt.power import regulated_power
from drivers.simulated.nxt_link import SimulatedLink
from drivers.simulated.nxt_robot import REPORT_ROBOT, NxtRobotConstants, SimulatedNxtRobot

DRIVE = DifferentialDrive(REPORT_ROBOT.wheel_radius_m, REPORT_ROBOT.half_track_m)
PORTS = (Output.B, Output.C)
SEEK = SeekSettings(Tolerance(0.002, 0.002, math.radians(1.0)), timeout_s=30.0, wheel_limit_rad_s=6.0)
SETTLE_S = 0.5


def legs(move: Move) -> Legs:
    """A move for the brick: the right motor is at B, the left one at C."""
    return dict(zip(PORTS, move, strict=True))


@dataclass(frozen=True, slots=True)
class Miss:
    """How far from the wanted pose a drive has ended; ``phase`` and ``cycle_s`` only under feedback."""

    position_m: float
    heading_rad: float
    phase: Phase | None = None
    cycle_s: float = 0.0

    def within(self, position_m: float, heading_rad: float) -> bool:
        return self.position_m <= position_m and abs(self.heading_rad) <= heading_rad


class NxtBench:
    """One robot; its start is where it is after a first line forward, so the play of its gears is taken up."""

    def __init__(self, seed: int = 0, constants: NxtRobotConstants = REPORT_ROBOT) -> None:
        self.robot = SimulatedNxtRobot(constants, seed)
        self.link = SimulatedLink(self.robot.brick)
        self.brick = Brick("simulated brick", self.link.connect)
        self._plays = [GearPlay(constants.play_rad) for _ in PORTS]
        self._aligned = AlignedTurns()
        self._loop = asyncio.get_running_loop()
        self._start = Pose()

    async def begin(self) -> None:
        self.brick.start()
        await self.brick.wait_ready()
        await self._turns()
        await self.brick.move(dict.fromkeys(PORTS, (30.0, 100.0)))
        await self.settle()
        await self._turns()
        self._start = self.pose()

    def pose(self) -> Pose:
        """Where the robot really is, in the frame of the floor."""
        self.robot.brick.catch_up()
        return Pose(self.robot.x_m, self.robot.y_m, self.robot.yaw_rad)

    async def settle(self) -> None:
        await asyncio.sleep(SETTLE_S)

    async def tachos(self) -> tuple[int, int]:
        right, left = [(await self.brick.output(port)).tacho_deg for port in PORTS]
        return right, left

    async def open_loop(self, move: Move) -> Miss:
        wanted = DRIVE.moved(Pose(), *(math.radians(leg.angle_deg) for leg in move))
        await self.brick.move(legs(move))
        return await self._miss(wanted)

    async def feedback(self, goal: Pose, settings: SeekSettings = SEEK) -> Miss:
        seeker, pose, cycles = GoalSeeker(DRIVE, goal, settings), Pose(), 0
        last, began_s = await self._turns(), self._loop.time()
        before_s = began_s
        while not seeker.done:
            turns, now_s = await self._turns(), self._loop.time()
            pose = DRIVE.moved(pose, turns[0] - last[0], turns[1] - last[1])
            speeds = seeker.step(pose, now_s - before_s)
            self.brick.run(dict(zip(PORTS, map(regulated_power, speeds), strict=True)))
            last, before_s, cycles = turns, now_s, cycles + 1
        self.brick.stop()
        miss = await self._miss(goal)
        return Miss(miss.position_m, miss.heading_rad, seeker.phase, (before_s - began_s) / cycles)

    async def _miss(self, wanted: Pose) -> Miss:
        await self.settle()
        start, now = self._start, self.pose()
        dx, dy = now.x_m - start.x_m, now.y_m - start.y_m
        cos, sin = math.cos(start.yaw_rad), math.sin(start.yaw_rad)
        position = math.hypot(cos * dx + sin * dy - wanted.x_m, cos * dy - sin * dx - wanted.y_m)
        return Miss(position, wrap_angle(now.yaw_rad - start.yaw_rad - wanted.yaw_rad))

    async def _turns(self) -> tuple[float, float]:
        turns = self._aligned.align(await self._turn(Output.B), await self._turn(Output.C))
        right, left = [play.follow(turn) for play, turn in zip(self._plays, turns, strict=True)]
        return right, left

    async def _turn(self, port: Output) -> tuple[float, float]:
        return math.radians((await self.brick.output(port)).tacho_deg), self._loop.time()


async def errors_of_lines(seed: int, compensated: bool) -> list[float]:
    """By how much [deg] each wheel misses its angle in the second and the following ones of six lines."""
    bench, wanted, compensation = NxtBench(seed), line(DRIVE, 0.2, 40), TachoCompensation()
    await bench.begin()
    errors: list[float] = []
    for _ in range(6):
        before = await bench.tachos()
        await bench.brick.move(legs(compensation.corrected(wanted) if compensated else wanted))
        await bench.settle()
        right, left = [now - then for now, then in zip(await bench.tachos(), before, strict=True)]
        compensation.moved(wanted, (right, left))
        errors += [right - wanted.right.angle_deg, left - wanted.left.angle_deg]
    await bench.brick.close()
    return errors[2:]
