"""The planner and traction control around the robot on ice: one drive, by one of three ways to answer slip."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Protocol

from daemon.loops.accelerometer import Accelerometer, Mounting, Vector, rotated
from daemon.loops.omni import OmniKinematics, turtle_wheels
from daemon.loops.planner import PlanarLimits, PlanarState, Tolerance, follow, plan_motion
from daemon.loops.published_planner_axis import AxisCase
from daemon.loops.published_traction import SafetyFactor as PublishedFactor
from daemon.loops.slip import AxisSlipDetector
from daemon.loops.slip_observer import Body, Observed, RimDrive, SlipObserver
from daemon.loops.traction import Traction, TractionRecord, TractionTuning, limited_lead
from vcan_tests.daemon import omni_floor
from vcan_tests.daemon.omni_floor import CYCLE_S

KINEMATICS = OmniKinematics(turtle_wheels(0.2, 0.2, 0.2))
PLACE, ROTATION = omni_floor.SENSOR
DRIVE = RimDrive(omni_floor.FORCE_PER_A, omni_floor.RIM_MASS_KG, omni_floor.FRICTION_N, omni_floor.EFFICIENCY)
BODY = Body(omni_floor.MASS_KG, omni_floor.YAW_INERTIA)
TOLERANCE = Tolerance(0.05, 0.1, 0.1, 0.5)
LONGEST_S = 12.0


@dataclass(frozen=True)
class RobotData:
    """What the loops know of a robot."""

    limits: PlanarLimits
    drive: RimDrive
    body: Body
    mounting: Mounting
    tuning: TractionTuning = field(default_factory=TractionTuning)


FLOOR_ROBOT = RobotData(PlanarLimits(1.5, 1.5, 3.0, 6.0), DRIVE, BODY, Mounting(PLACE.real, PLACE.imag, ROTATION))
SLIPS_M_S = 0.06
"""True slip speed of a wheel that counts as slip."""
TOGETHER_S = 0.1
"""Slip events nearer than this are one; a detection this near to an event is of that event."""


@dataclass
class Cycle:
    """One cycle of a drive, as it was and as it was seen."""

    time: float
    place: complex
    heading: float
    planned: PlanarState
    factor: float
    slip: bool
    true_slip: float
    record: TractionRecord | None
    observed: Observed | None


@dataclass
class Drive:
    """What became of one drive."""

    cycles: list[Cycle] = field(default_factory=list)
    arrived_s: float = math.inf

    def aside(self, direction: complex) -> float:
        """Largest distance to the side of a line through the start, until the end."""
        return max(abs((cycle.place * direction.conjugate()).imag) for cycle in self.cycles)

    def factor_changes(self) -> int:
        return sum(a.factor != b.factor for a, b in pairwise(self.cycles))

    def factor_travel(self) -> float:
        """Sum of all changes of the safety factor."""
        return sum(abs(a.factor - b.factor) for a, b in pairwise(self.cycles))

    def turned_round(self) -> int:
        """Times that the safety factor changed its direction."""
        changes = [b.factor - a.factor for a, b in pairwise(self.cycles) if a.factor != b.factor]
        return sum(a * b < 0 for a, b in pairwise(changes))

    def events(self) -> tuple[int, int, int]:
        """Slip events detected, missed and false."""
        true = spans([cycle.true_slip > SLIPS_M_S for cycle in self.cycles], at_least=3)
        seen = spans([cycle.slip for cycle in self.cycles], at_least=1)
        detected = sum(any(near(event, other) for other in seen) for event in true)
        false = sum(not any(near(event, other) for other in true) for event in seen)
        return detected, len(true) - detected, false


def spans(flags: list[bool], at_least: int) -> list[tuple[int, int]]:
    """First and last cycle of each run of flags; short runs are left out, near ones joined."""
    runs: list[tuple[int, int]] = []
    start = None
    for number, flag in enumerate([*flags, False]):
        if flag and start is None:
            start = number
        if not flag and start is not None:
            if runs and start - runs[-1][1] <= TOGETHER_S / CYCLE_S:
                runs[-1] = (runs[-1][0], number - 1)
            elif number - start >= at_least:
                runs.append((start, number - 1))
            start = None
    return runs


def near(a: tuple[int, int], b: tuple[int, int]) -> bool:
    reach = TOGETHER_S / CYCLE_S
    return a[0] <= b[1] + reach and b[0] <= a[1] + reach


class Floor(Protocol):
    """A robot in its room: :class:`OmniFloor`, or the twin in :mod:`vcan_tests.daemon.omni_twin`."""

    reading: Vector
    rims: list[float]
    currents: list[float]
    slips: list[float]
    place: complex
    velocity: complex
    heading: float

    def roll(self, rim_targets: tuple[float, ...]) -> None: ...


class Answer:
    """No answer to slip at all."""

    factor = 1.0
    slip = False
    record: TractionRecord | None = None

    def step(self, measured: Vector, commanded: Vector, cruising: bool, overshoot: bool, slipping: bool) -> None:
        """One cycle."""


class PublishedAnswer(Answer):
    """As the report prints it."""

    def __init__(self, threshold: float = 0.1) -> None:
        self._detectors = (AxisSlipDetector(threshold), AxisSlipDetector(threshold))
        self._factor = PublishedFactor()

    def step(self, measured: Vector, commanded: Vector, cruising: bool, overshoot: bool, slipping: bool) -> None:
        case = AxisCase.TOP_SPEED if cruising else AxisCase.TO_TOP_SPEED
        x, y = (
            detector.step(of, wanted, case)
            for detector, of, wanted in zip(self._detectors, measured, commanded, strict=True)
        )
        self._factor.limit(1.0, (x, y))
        self.factor, self.slip = self._factor.factor, x or y


class ImprovedAnswer(Answer):
    """As it should be."""

    def __init__(self, robot: RobotData = FLOOR_ROBOT) -> None:
        self._traction = Traction(robot.limits.acceleration, robot.tuning)

    def step(self, measured: Vector, commanded: Vector, cruising: bool, overshoot: bool, slipping: bool) -> None:
        self.record = self._traction.step(measured, commanded, CYCLE_S, cruising, overshoot, slipping=slipping)
        self.factor, self.slip = self.record.safety_factor, self.record.signal.slip or slipping


SLIP_M_S = 0.03
LAG_S = 0.04
"""From a command to the motion that it makes."""


class Daemon:
    """Odometry, planner and traction as one cycle of control.

    Args:
        start: state of the robot.
        goal: where to.
        answer: to slip. Without one (:class:`Answer` itself) the wheels are believed, else the observer is.
        by_currents: there is no accelerometer.
        robot: its data.
    """

    def __init__(
        self, start: PlanarState, goal: PlanarState, answer: Answer, by_currents: bool, robot: RobotData
    ) -> None:
        self._goal = goal
        self._all = robot.limits
        self._answer = answer
        self._sensor = None if by_currents else Accelerometer(robot.mounting)
        self._observer = SlipObserver(robot.body, [robot.drive] * 3, KINEMATICS.forward)
        self._believes_wheels = type(answer) is Answer
        self._pose = self.target = start
        self._yaw_rate = 0.0
        self._commanded: Vector = (0.0, 0.0)
        self.plan = plan_motion(start, goal, robot.limits)
        self.observed: Observed | None = None

    def step(self, floor: Floor, now: float) -> tuple[float, ...]:
        """Rim speeds to command."""
        measured = None
        if self._sensor is not None:
            measured = self._sensor.step(floor.reading, self._yaw_rate, CYCLE_S).centre
        self.observed = seen = self._observer.step(floor.rims, floor.currents, CYCLE_S, measured)
        self._yaw_rate = seen.motion[2]
        self._move(KINEMATICS.body_motion(floor.rims) if self._believes_wheels else seen.motion)
        acceleration = rotated((seen.acceleration[0], seen.acceleration[1]), self._pose.heading)
        cruising = self.plan.way.case(now - self.plan.began) == "cruise"
        factor = self._answer.factor
        overshoot = _passes(self._pose, self._goal, factor * self._all.acceleration)
        self._answer.step(acceleration, self._commanded, cruising, overshoot, any(seen.slipping))
        start = self._start(any(seen.slipping) and not self._believes_wheels)
        if self._answer.factor != factor:
            self.plan = plan_motion(start, self._goal, self._limits(), now)
        step = follow(self.plan, now, start, CYCLE_S, TOLERANCE)
        self.plan, self._commanded, self.target = step.plan, step.acceleration_m_s2, step.next
        ahead = rotated((self.target.vx, self.target.vy), -self._pose.heading)
        return KINEMATICS.wheel_speeds((*ahead, self.target.rate))

    def _limits(self) -> PlanarLimits:
        factor = self._answer.factor
        turn = max(0.3, factor) * self._all.angular_acceleration
        return replace(self._all, acceleration=factor * self._all.acceleration, angular_acceleration=turn)

    def _move(self, motion: tuple[float, float, float]) -> None:
        """Odometry."""
        pose = self._pose
        vx, vy = rotated((motion[0], motion[1]), pose.heading)
        x, y, heading = pose.x + vx * CYCLE_S, pose.y + vy * CYCLE_S, pose.heading + motion[2] * CYCLE_S
        self._pose = PlanarState(x, y, heading, vx, vy, motion[2])

    def _start(self, slipping: bool) -> PlanarState:
        """Where the robot will be when a command of now takes effect.

        Where nothing slips it will be as fast as commanded, and else little faster or slower than it is.
        """
        pose, target = self._pose, self.target
        vx, vy, rate = target.vx, target.vy, target.rate
        if slipping:
            lead = SLIP_M_S + LAG_S * self._all.acceleration * self._answer.factor
            vx, vy = limited_lead((vx, vy), (pose.vx, pose.vy), lead)
            rate = pose.rate + max(-lead / 0.2, min(lead / 0.2, rate - pose.rate))
        return PlanarState(
            pose.x + LAG_S * (pose.vx + vx) / 2,
            pose.y + LAG_S * (pose.vy + vy) / 2,
            pose.heading + LAG_S * (pose.rate + rate) / 2,
            vx,
            vy,
            rate,
        )


def drive(
    floor: Floor, goal: PlanarState, answer: Answer, *, by_currents: bool = False, robot: RobotData = FLOOR_ROBOT
) -> Drive:
    """Drive to a goal."""
    driven = Drive()
    daemon = Daemon(PlanarState(vx=floor.velocity.real, vy=floor.velocity.imag), goal, answer, by_currents, robot)
    for number in range(round(LONGEST_S / CYCLE_S)):
        now = number * CYCLE_S
        slip = max(map(abs, floor.slips))
        floor.roll(daemon.step(floor, now))
        driven.cycles.append(
            Cycle(
                now,
                floor.place,
                floor.heading,
                daemon.target,
                answer.factor,
                answer.slip,
                slip,
                answer.record,
                daemon.observed,
            )
        )
        if driven.arrived_s == math.inf and now >= daemon.plan.ends:
            driven.arrived_s = now
        if now > driven.arrived_s + 0.3:
            break
    return driven


def _passes(pose: PlanarState, goal: PlanarState, acceleration: float) -> bool:
    """Whether the goal is nearer than the way to rest."""
    left = math.hypot(goal.x - pose.x, goal.y - pose.y)
    return left > 0.02 and pose.vx**2 + pose.vy**2 > 2 * acceleration * left * 1.02
