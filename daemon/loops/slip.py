"""Slip of a robot's tyres as the Turtle robot's report detects it (section 7.2.1, listing 7.2).

An axis slips when measured and commanded acceleration differ too much. Near the speed limit the planner's command
jumps by itself (cases 3 and 5, and 21 in between), so slip is ignored there and for some steps after.
"""

from __future__ import annotations

from typing import Final

from daemon.loops.published_planner_axis import AxisCase

THRESHOLD_M_S2: Final = 0.1
"""Of the difference (EPSILON_SLIP); the report gives no value."""
STEPS_NEAR_TOP_SPEED: Final = 5
"""What the countdown (roundmax) starts from; being counted down before it is tested, it covers four steps."""

_NEAR_TOP_SPEED: Final = (AxisCase.TOP_SPEED, AxisCase.TOO_FAST)


class AxisSlipDetector:
    """Slip in one direction of the robot's plane.

    Attributes:
        countdown: steps that are left of those near the speed limit; runs on below 0.
    """

    def __init__(self, threshold_m_s2: float = THRESHOLD_M_S2) -> None:
        self._threshold_m_s2 = threshold_m_s2
        self.countdown = 0

    def step(self, measured: float, commanded: float, previous_case: int | None) -> bool:
        """Whether the axis slips.

        Args:
            measured: acceleration [m/s2].
            commanded: acceleration that the measured one should be [m/s2].
            previous_case: what the planner did with this axis in the step before, an :class:`AxisCase`.
        """
        near_top_speed = previous_case in _NEAR_TOP_SPEED
        self.countdown = STEPS_NEAR_TOP_SPEED if near_top_speed else self.countdown - 1
        if near_top_speed or (previous_case == AxisCase.TO_TOP_SPEED and self.countdown > 0):
            return False
        return abs(measured - commanded) >= self._threshold_m_s2
