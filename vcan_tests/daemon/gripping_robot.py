"""The law of the omni-wheel vehicle on a floor with ice: one drive, by one of three ways to answer slip."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import pairwise

from daemon.loops.accelerometer import Mounting
from daemon.loops.measurement import Measurement
from daemon.loops.omni import OmniKinematics, turtle_wheels
from daemon.loops.omni_drive import OmniLaw, OmniRecord
from daemon.loops.omni_guide import GoalGuide, Guide, PublishedGuide
from daemon.loops.omni_senses import BY_ACCELEROMETER, BY_CURRENTS, OmniSenses
from daemon.loops.planner import PlanarLimits, PlanarState, Result
from daemon.loops.slip_observer import Body, RimDrive, SlipObserver
from daemon.loops.traction import Traction, TractionTuning
from vcan_tests.daemon import omni_floor
from vcan_tests.daemon.omni_floor import CYCLE_S, OmniFloor

KINEMATICS = OmniKinematics(turtle_wheels(0.2, 0.2, 0.2))
PLACE, ROTATION = omni_floor.SENSOR
DRIVE = RimDrive(omni_floor.FORCE_PER_A, omni_floor.RIM_MASS_KG, omni_floor.FRICTION_N, omni_floor.EFFICIENCY)
BODY = Body(omni_floor.MASS_KG, omni_floor.YAW_INERTIA)
LONGEST_S = 12.0
LIMITS = PlanarLimits(1.5, 1.5, 3.0, 6.0)
MOUNTING = Mounting(PLACE.real, PLACE.imag, ROTATION)
TUNING = TractionTuning(delay_cycles=2)
SLIPS_M_S = 0.06
"""True slip speed of a wheel that counts as slip."""
TOGETHER_S = 0.1
"""Slip events nearer than this are one; a detection this near to an event is of that event."""


@dataclass
class Cycle:
    """One cycle of a drive, as it was and as it was seen."""

    time: float
    place: complex
    factor: float
    slip: bool
    true_slip: float


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


class Way(StrEnum):
    """How slip is answered."""

    OFF = "off"
    PUBLISHED = "published"
    IMPROVED = "improved"


def guide(way: Way, goal: PlanarState) -> Guide:
    """What leads the robot to a goal."""
    if way is Way.PUBLISHED:
        return PublishedGuide(goal, LIMITS, CYCLE_S, None, 0.1)
    traction = Traction(LIMITS.acceleration, TUNING) if way is Way.IMPROVED else None
    return GoalGuide(goal, LIMITS, traction)


class Daemon:
    """The law of the omni-wheel vehicle on a floor."""

    def __init__(self, floor: OmniFloor, goal: PlanarState, way: Way, by_currents: bool) -> None:
        self._floor = floor
        self._by_currents = by_currents
        tuning = BY_CURRENTS if by_currents else BY_ACCELEROMETER
        observer = SlipObserver(BODY, [DRIVE] * 3, KINEMATICS.forward, tuning=tuning)
        self.senses = OmniSenses(KINEMATICS, MOUNTING, observer if way is Way.IMPROVED else None)
        self._travel = [0.0, 0.0, 0.0]
        self._feel(0.0)
        self.law = OmniLaw(KINEMATICS, guide(way, goal), LIMITS, self.senses)

    def step(self, now: float) -> OmniRecord:
        """One cycle: feel, decide, roll."""
        self._feel(now)
        command, record = self.law.step(self.senses, CYCLE_S)
        self._floor.roll(command.wheel_speed_m_s)
        return record

    def _feel(self, now: float) -> None:
        floor = self._floor
        self._travel = [way + speed * CYCLE_S for way, speed in zip(self._travel, floor.rims, strict=True)]
        rims, currents = tuple(floor.rims), tuple(floor.currents)
        reading = None if self._by_currents else floor.reading
        measurement = Measurement(now, rims, tuple(self._travel), acceleration_m_s2=reading, motor_current_a=currents)
        self.senses.update(measurement, CYCLE_S, powered=True, standing=False)


def drive(floor: OmniFloor, goal: PlanarState, way: Way, *, by_currents: bool = False) -> Drive:
    """Drive to a goal."""
    driven = Drive()
    daemon = Daemon(floor, goal, way, by_currents)
    for number in range(round(LONGEST_S / CYCLE_S)):
        now = number * CYCLE_S
        slip = max(map(abs, floor.slips))
        told = daemon.step(now).guidance
        driven.cycles.append(Cycle(now, floor.place, told.safety_factor, any(told.slip), slip))
        if driven.arrived_s == math.inf and told.result is Result.ARRIVED:
            driven.arrived_s = now
        if now > driven.arrived_s + 0.3:
            break
    return driven
