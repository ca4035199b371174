"""The law of a robot whose wheels steer in pairs: come to rest, turn one pair after the other, drive.

A new direction takes, as the MAX2D thesis (section 4.1) describes it: front brake released while the rear one is
engaged, front pair turned by its own wheels, front brake engaged; then the rear pair likewise; then all four wheels
drive with both brakes engaged. Every step waits until the brakes certainly are where they shall be.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from enum import StrEnum
from typing import Final

import msgspec

from canhelm.errors import CanhelmError
from daemon.loops.geometry import (
    FRONT,
    PAIR_NAMES,
    REAR,
    TURN_SIGN,
    WHEELS_OF_PAIR,
    PerPair,
    PerWheel,
    Point,
    clamp,
)
from daemon.loops.locked_drive import LockedDrive
from daemon.loops.measurement import Command, Measurement
from daemon.loops.motion_profile import ARRIVED_M, ramp, speed_to_end
from daemon.loops.paired_steer_target import PairedSteerTarget, check_target
from daemon.loops.paired_traction import PairedTraction
from daemon.loops.slip_observer import RimDrive
from daemon.loops.steering import REST_SPEED_M_S, SETTLE_TIME_S, PairSteering, SteeringPhase
from profiles.schema import Limits, PairedSteerGeometry

RESTEER_RAD: Final = math.radians(1.0)
"""While driving without an end, a new direction that differs less than this is not steered for."""
WAIT_S: Final = 3.0
"""Time that brakes and wheels have to come to where they are commanded."""
MAX_TURNS: Final = 3
"""Times that one pair is turned for one motion before its heading counts as not holding."""

_STANDING: Final[PerWheel] = (0.0, 0.0, 0.0, 0.0)


class Phase(StrEnum):
    """What the law is doing."""

    STOPPING = "stopping"
    """Coming to rest, and waiting for both brakes to be engaged."""
    RELEASING_BRAKE = "releasing_brake"
    TURNING_PAIR = "turning_pair"
    ENGAGING_BRAKE = "engaging_brake"
    DRIVING = "driving"
    RESTING = "resting"
    """Nothing to do, or done."""
    FAILED = "failed"


class PairedSteerRecord(msgspec.Struct, frozen=True, gc=False):
    """The terms of one step.

    Attributes:
        phase: what the law is doing.
        pair: name of the pair being turned, or None.
        heading_error_rad: target minus measured heading of each pair; 0 where the target keeps the heading.
        speed_m_s: commanded speed of the robot's centre.
        rim_speed_m_s: commanded rim speed of the pair being turned.
        remaining_m: way still to command; None for a motion without an end.
        icr_m: centre of rotation in the robot's frame while driving a curve.
        centre_radius_m: its distance from the robot's centre; infinite on a line, None when not driving.
        yaw_rate_rad_s: commanded.
        mismatch_rad: angle between real and computed direction of each wheel while driving.
        limits_active: limits that hold the command back.
        warnings: what is permitted but will not be driven as computed.
        done: the motion with an end is over, or without a target the robot rests.
        failure: why the motion was given up, or "".
    """

    phase: Phase
    pair: str | None
    heading_error_rad: PerPair
    speed_m_s: float
    rim_speed_m_s: float
    remaining_m: float | None
    icr_m: Point | None
    centre_radius_m: float | None
    yaw_rate_rad_s: float
    mismatch_rad: PerWheel
    limits_active: tuple[str, ...]
    warnings: tuple[str, ...]
    done: bool
    failure: str


class PairedSteerLaw:
    """Sequencer and speed law; the kinematics are those of :func:`daemon.loops.geometry.solve_turning`.

    Wheel speeds while driving are computed from the headings that the pairs were steered to, not from each cycle's
    reading: that is what the brakes hold, and the encoders' resolution does not get into the speeds.

    Args:
        geometry: the robot.
        limits: of the vehicle.
        rim_drives: of wheels 1 to 4, to hold wheels that slip; without them slip is not answered.
    """

    def __init__(self, geometry: PairedSteerGeometry, limits: Limits, rim_drives: Sequence[RimDrive] = ()) -> None:
        self._geometry = geometry
        self._rim_drives = rim_drives
        self._traction: PairedTraction | None = None
        self._slips = False
        self._limits = limits
        self._tolerance_rad = math.radians(limits.heading_tolerance_deg)
        self._steps: dict[Phase, Callable[[Measurement, float], PerWheel]] = {
            Phase.STOPPING: self._stop,
            Phase.RELEASING_BRAKE: self._release,
            Phase.TURNING_PAIR: self._turn,
            Phase.ENGAGING_BRAKE: self._engage,
            Phase.DRIVING: self._drive,
            Phase.RESTING: self._rest,
            Phase.FAILED: self._rest,
        }
        self._target: PairedSteerTarget | None = None
        self._phase = Phase.STOPPING
        self._in_phase_s = 0.0
        self._at_rest_s = 0.0
        self._failure = ""
        self._pair: int | None = None
        self._goal_rad: float | None = None
        self._turns = [0, 0]
        self._steering = PairSteering(geometry.contact_offset_m, limits)
        self._rim_speed_m_s = 0.0
        self._locked: LockedDrive | None = None
        self._speed_m_s = 0.0
        self._ramping = False
        self._finished = False
        self._remaining_m: float | None = None

    def step(
        self, measurement: Measurement, target: PairedSteerTarget | None, dt: float
    ) -> tuple[Command, PairedSteerRecord]:
        """One cycle.

        Args:
            measurement: of this cycle, with headings and brakes in the order rear, front.
            target: the motion; another object than last time starts another motion, from whatever the robot is just
                doing. None comes to rest with both brakes engaged.
            dt: time since the last step [s], positive.

        Returns:
            what to command for the next ``dt``, and the terms. After a failure the robot comes to rest and stays
            there until there is another target. A target that ``check_target`` refuses is a failure.
        """
        if target is not self._target:
            self._begin(target)
        self._in_phase_s += dt
        wheels = self._gripping(self._steps[self._phase](measurement, dt), measurement, dt)
        released = self._pair if self._phase in (Phase.RELEASING_BRAKE, Phase.TURNING_PAIR) else None
        return Command(wheels, (released == REAR, released == FRONT)), self._record(measurement)

    def _gripping(self, wheels: PerWheel, measurement: Measurement, dt: float) -> PerWheel:
        """The wheel speeds, those of slipping wheels held back."""
        self._slips = False
        if self._traction is None or self._pair is not None:
            return wheels
        record = self._traction.step(wheels, measurement.wheel_speed_m_s, measurement.motor_current_a, dt)
        self._slips = any(record.grip.limited)
        first, second, third, fourth = record.grip.wheel_speeds_m_s
        return (first, second, third, fourth)

    def _begin(self, target: PairedSteerTarget | None) -> None:
        self._target = target
        self._turns = [0, 0]
        self._finished = False
        self._remaining_m = None
        if target is not None and target.distance_m is not None:
            self._remaining_m = math.copysign(target.distance_m, target.speed_m_s)
        if self._pair is not None:
            self._redirect(self._pair)
        else:
            self._enter(Phase.DRIVING if self._may_roll_on() else Phase.STOPPING)
        self._failure = ""
        self._check()

    def _check(self) -> None:
        try:
            if self._target is not None:
                check_target(self._geometry, self._limits, self._target)
        except CanhelmError as refusal:
            self._fail(str(refusal))

    def _redirect(self, pair: int) -> None:
        """Let the pair that is being turned follow the new target, unless it is as good as the old one.

        One whose brake is only being released is left alone where nobody wants it turned any more.
        """
        wanted = self._wanted_heading(pair)
        if wanted is None or self._goal_rad is None or not abs(wanted - self._goal_rad) <= self._threshold_rad():
            self._goal_rad = wanted
        if wanted is None and self._phase is Phase.RELEASING_BRAKE:
            self._enter(Phase.ENGAGING_BRAKE)

    def _may_roll_on(self) -> bool:
        """Whether the new motion goes on from the rolling one without new headings."""
        if self._failure or self._locked is None:
            return False
        rolling = self._phase is Phase.DRIVING or self._speed_m_s != 0
        return rolling and self._moves() and self._next_pair(self._locked.heading_rad) is None

    def _moves(self) -> bool:
        return self._target is not None and self._target.moves and not self._finished

    def _threshold_rad(self) -> float:
        endless = self._target is not None and self._target.distance_m is None
        return RESTEER_RAD if endless else self._tolerance_rad

    def _heading_errors(self, heading_rad: tuple[float, ...]) -> PerPair:
        if self._target is None:
            return (0.0, 0.0)
        (rear, front), (rear_goal, front_goal) = heading_rad, self._target.headings_rad
        return 0.0 if rear_goal is None else rear_goal - rear, 0.0 if front_goal is None else front_goal - front

    def _wanted_heading(self, pair: int) -> float | None:
        return None if self._target is None else self._target.headings_rad[pair]

    def _next_pair(self, heading_rad: tuple[float, ...]) -> int | None:
        """The pair to turn next, front before rear; a target that stands still forever turns none."""
        if self._target is None or self._finished or (self._target.distance_m is None and not self._target.moves):
            return None
        threshold, errors = self._threshold_rad(), self._heading_errors(heading_rad)
        return next((pair for pair in (FRONT, REAR) if not abs(errors[pair]) <= threshold), None)

    def _enter(self, phase: Phase) -> None:
        if phase is not self._phase:
            self._phase = phase
            self._in_phase_s = self._at_rest_s = 0.0

    def _fail(self, reason: str) -> PerWheel:
        self._failure = reason
        self._pair = None
        self._rim_speed_m_s = 0.0
        self._enter(Phase.FAILED)
        return self._wheels()

    def _wheels(self) -> PerWheel:
        """Wheel speeds for the commanded speed of the centre."""
        return _STANDING if self._locked is None else self._locked.wheel_speeds(self._speed_m_s)

    def _rest(self, measurement: Measurement, dt: float) -> PerWheel:
        if self._locked is not None:
            self._speed_m_s = ramp(self._speed_m_s, 0.0, self._locked.acceleration_m_s2, dt)
        return self._wheels()

    def _stop(self, measurement: Measurement, dt: float) -> PerWheel:
        if self._speed_m_s != 0:
            self._in_phase_s = self._at_rest_s = 0.0
            return self._rest(measurement, dt)
        resting = all(abs(speed) <= REST_SPEED_M_S for speed in measurement.wheel_speed_m_s)
        self._at_rest_s = self._at_rest_s + dt if resting else 0.0
        if not resting:
            return self._wait("the wheels do not come to rest")
        if not all(measurement.brake_engaged):
            return self._wait(self._not_engaged(measurement))
        return self._from_rest(measurement) if self._at_rest_s >= SETTLE_TIME_S else _STANDING

    def _wait(self, sentence: str) -> PerWheel:
        return _STANDING if self._in_phase_s <= WAIT_S else self._fail(f"{sentence} within {WAIT_S:g} s")

    @staticmethod
    def _not_engaged(measurement: Measurement) -> str:
        loose = [name for name, engaged in zip(PAIR_NAMES, measurement.brake_engaged, strict=True) if not engaged]
        return f"the {' and '.join(loose)} steering brake is not certainly engaged"

    def _from_rest(self, measurement: Measurement) -> PerWheel:
        pair = self._next_pair(measurement.heading_rad)
        if pair is not None:
            return self._begin_turn(pair, measurement)
        if self._moves():
            headings = self._locked_headings(measurement)
            self._locked = LockedDrive(self._geometry, self._limits, headings)
            if self._rim_drives:
                self._traction = PairedTraction(self._geometry, self._rim_drives, headings)
            self._enter(Phase.DRIVING)
        else:
            self._finished = self._target is not None and self._target.distance_m is not None
            self._enter(Phase.RESTING)
        return _STANDING

    def _begin_turn(self, pair: int, measurement: Measurement) -> PerWheel:
        if self._turns[pair] >= MAX_TURNS:
            error = math.degrees(self._heading_errors(measurement.heading_rad)[pair])
            return self._fail(
                f"the {PAIR_NAMES[pair]} pair does not hold its heading: {error:.2f} deg off after "
                f"{MAX_TURNS} turns; check its brake"
            )
        self._turns[pair] += 1
        self._pair = pair
        self._goal_rad = self._wanted_heading(pair)
        self._steering = PairSteering(self._geometry.contact_offset_m, self._limits)
        self._enter(Phase.RELEASING_BRAKE)
        return _STANDING

    def _release(self, measurement: Measurement, dt: float) -> PerWheel:
        pair = self._turning_pair()
        if measurement.brake_released[pair] and measurement.brake_engaged[1 - pair]:
            self._enter(Phase.TURNING_PAIR)
            return _STANDING
        return self._wait(f"the {PAIR_NAMES[pair]} steering brake is not certainly released with the other one engaged")

    def _turning_pair(self) -> int:
        assert self._pair is not None
        return self._pair

    def _turn(self, measurement: Measurement, dt: float) -> PerWheel:
        pair = self._turning_pair()
        if not (measurement.brake_released[pair] and measurement.brake_engaged[1 - pair]):
            return self._fail(f"the steering brakes changed while the {PAIR_NAMES[pair]} pair turned")
        first, second = WHEELS_OF_PAIR[pair]
        speeds = (measurement.wheel_speed_m_s[first], measurement.wheel_speed_m_s[second])
        record = self._steering.step(measurement.heading_rad[pair], self._goal_rad, speeds, dt)
        if record.phase is SteeringPhase.FAILED:
            return self._fail(f"{PAIR_NAMES[pair]}: {record.failure}")
        if record.phase is SteeringPhase.DONE:
            self._enter(Phase.ENGAGING_BRAKE)
        self._rim_speed_m_s = record.rim_speed_m_s
        wheels = [0.0, 0.0, 0.0, 0.0]
        wheels[first] = TURN_SIGN[first] * record.rim_speed_m_s
        wheels[second] = TURN_SIGN[second] * record.rim_speed_m_s
        return (wheels[0], wheels[1], wheels[2], wheels[3])

    def _engage(self, measurement: Measurement, dt: float) -> PerWheel:
        pair = self._turning_pair()
        if not measurement.brake_engaged[pair]:
            return self._wait(f"the {PAIR_NAMES[pair]} steering brake is not certainly engaged")
        self._pair = None
        self._enter(Phase.STOPPING)
        return _STANDING

    def _locked_headings(self, measurement: Measurement) -> PerPair:
        """Where the brakes hold the pairs: the target where they were steered to it, else the reading."""
        stop_rad = math.radians(self._geometry.max_heading_deg)
        errors = self._heading_errors(measurement.heading_rad)
        rear, front = (
            heading + error if abs(error) <= self._tolerance_rad else clamp(heading, stop_rad)
            for heading, error in zip(measurement.heading_rad, errors, strict=True)
        )
        return (rear, front)

    def _drive(self, measurement: Measurement, dt: float) -> PerWheel:
        if not all(measurement.brake_engaged):
            return self._fail(f"{self._not_engaged(measurement)} while driving")
        assert self._locked is not None
        assert self._target is not None
        slipped = self._locked.slipped_pair(measurement.heading_rad)
        if slipped is not None:
            return self._fail(f"the {PAIR_NAMES[slipped]} pair turned although its brake is engaged; check its brake")
        before, acceleration = self._speed_m_s, self._locked.acceleration_m_s2
        if self._remaining_m is None:
            self._speed_m_s = ramp(before, self._target.speed_m_s, acceleration, dt)
        else:
            limit, way = abs(self._target.speed_m_s), self._remaining_m
            self._speed_m_s = speed_to_end(before, limit, acceleration, way, dt)
            self._remaining_m = way - self._speed_m_s * dt
            if self._speed_m_s == 0 and abs(self._remaining_m) < ARRIVED_M:
                self._finished = True
                self._enter(Phase.STOPPING)
        self._ramping = abs(self._speed_m_s - before) > acceleration * dt * (1 - 1e-9)
        return self._wheels()

    def _record(self, measurement: Measurement) -> PairedSteerRecord:
        driving = self._locked if self._phase is Phase.DRIVING else None
        unit = driving.unit if driving else None
        return PairedSteerRecord(
            phase=self._phase,
            pair=None if self._pair is None else PAIR_NAMES[self._pair],
            heading_error_rad=self._heading_errors(measurement.heading_rad),
            speed_m_s=self._speed_m_s,
            rim_speed_m_s=self._rim_speed_m_s if self._phase is Phase.TURNING_PAIR else 0.0,
            remaining_m=self._remaining_m,
            icr_m=unit.icr_m if unit else None,
            centre_radius_m=unit.centre_radius_m if unit else None,
            yaw_rate_rad_s=self._speed_m_s * unit.yaw_rate_rad_s if unit else 0.0,
            mismatch_rad=unit.mismatch_rad if unit else _STANDING,
            limits_active=self._limits_active() if unit else (),
            warnings=driving.warnings if driving else (),
            done=self._phase is Phase.RESTING and (self._target is None or self._finished),
            failure=self._failure,
        )

    def _limits_active(self) -> tuple[str, ...]:
        if not (self._ramping or self._slips):
            return ()
        active = {"acceleration": self._ramping, "traction": self._slips}
        return tuple(name for name, holds in active.items() if holds)
