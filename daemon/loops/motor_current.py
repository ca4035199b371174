"""A motor's current and what its wheel does with it: much current in vain, or motion without any.

No load is known here, so a current is not compared with a torque. Compared is what holds under any load: a motor that
is given as much as it can carry for ever moves its wheel, and one that gets none neither pulls a wheel that is late nor
makes one faster.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from profiles.schema import DriveConfig, Profile

TIME_S: Final = 0.25
"""For how long; eight times as long as any simulated robot is late at such a current on its published drives."""
STRONG_SHARE: Final = 0.9
"""Of the continuous current: what a drive that has warmed up too far is held to, with the scatter of the reading."""
WEAK_SHARE: Final = 0.25
"""Of the current that the motor alone takes at no load: less than that is none."""
LATE_SHARE: Final = 0.2
"""Of the commanded speed that a late wheel lacks."""
LATE_OF_FASTEST: Final = 0.02
"""Of the drive's largest speed that it lacks at least: slower than that nobody can tell it from rest."""
VAIN_SHARE: Final = 0.25
"""A wheel whose speed comes nearer to the command by this part of the vehicle's acceleration is on its way."""


class Misfit(StrEnum):
    """How a current does not fit the motion."""

    IN_VAIN = "in vain"
    NONE = "none"


@dataclass(frozen=True, slots=True)
class CurrentLimits:
    """Of one motor.

    Attributes:
        time_s: for which a misfit has to last.
        strong_a: current from which on the wheel has to move.
        weak_a: current below which it cannot be the motor that moves it.
        late_m_s: what a late wheel lacks at least.
        gain_m_s: by which the vehicle can be faster after that time.
    """

    time_s: float
    strong_a: float
    weak_a: float
    late_m_s: float
    gain_m_s: float


def current_limits(profile: Profile, drive: DriveConfig) -> CurrentLimits:
    """The limits of one drive of a robot."""
    time_s = profile.plausibility.current_s or TIME_S
    return CurrentLimits(
        time_s,
        STRONG_SHARE * drive.continuous_current_a,
        WEAK_SHARE * drive.motor.no_load_current_a,
        LATE_OF_FASTEST * drive.max_speed_m_s,
        profile.limits.acceleration_m_s2 * time_s,
    )


class CurrentAndMotion:
    """One motor and its wheel.

    Args:
        limits: of it.
    """

    def __init__(self, limits: CurrentLimits) -> None:
        self.limits = limits
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget what was seen."""
        self._misfit: Misfit | None = None
        self._since_s = 0.0
        self._begin_m_s = 0.0
        self._slowest_m_s: float | None = None

    def look(self, current_a: float, speed_m_s: float, commanded_m_s: float, dt_s: float) -> Misfit | None:
        """What does not fit, and has not for long enough; or None.

        Args:
            current_a: of the motor, positive where it drives forward.
            speed_m_s: of the wheel's rim.
            commanded_m_s: what it was commanded since the last look.
            dt_s: since then.
        """
        lacks_m_s = commanded_m_s - speed_m_s
        if abs(lacks_m_s) >= self.limits.late_m_s or self._misfit is not None:
            misfit = self._late(current_a, lacks_m_s, speed_m_s, commanded_m_s, dt_s)
            if misfit is not None:
                return misfit
        if abs(current_a) >= self.limits.weak_a:
            self._slowest_m_s = None
            return None
        return self._dragged(abs(speed_m_s))

    def _late(
        self, current_a: float, lacks_m_s: float, speed_m_s: float, commanded_m_s: float, dt_s: float
    ) -> Misfit | None:
        """What has not fitted for long enough with a wheel that lacks speed."""
        limits = self.limits
        towards = 1.0 if lacks_m_s > 0 else -1.0
        misfit = self._misfit_of(current_a * towards, lacks_m_s, commanded_m_s)
        gained_m_s = (speed_m_s - self._begin_m_s) * towards
        if misfit is not self._misfit or gained_m_s >= VAIN_SHARE * limits.gain_m_s:
            self._misfit, self._begin_m_s, self._since_s = misfit, speed_m_s, 0.0
        self._since_s += dt_s
        return misfit if self._since_s >= limits.time_s else None

    def _misfit_of(self, towards_a: float, lacks_m_s: float, commanded_m_s: float) -> Misfit | None:
        limits = self.limits
        if abs(lacks_m_s) < max(limits.late_m_s, LATE_SHARE * abs(commanded_m_s)):
            return None
        if towards_a >= limits.strong_a:
            return Misfit.IN_VAIN
        return Misfit.NONE if abs(towards_a) < limits.weak_a else None

    def _dragged(self, speed_m_s: float) -> Misfit | None:
        """Whether a wheel without current has become faster by more than its share."""
        slowest = self._slowest_m_s
        self._slowest_m_s = speed_m_s if slowest is None else min(slowest, speed_m_s)
        return Misfit.NONE if speed_m_s - self._slowest_m_s >= self.limits.gain_m_s else None
