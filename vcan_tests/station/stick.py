"""Driving by the stick on the page, as somebody does who is told to let go and hold it again."""

from __future__ import annotations

from collections.abc import Callable

from vcan_tests.station.browser import Operator
from vcan_tests.station.processes import Robot, Status

TOLD_TO = "hold it again to drive"
"""What the page says when the answers of the robot come too late to drive by, as those of a busy machine."""
TRIES = 5
WITHIN_S = 5.0


def drives(operator: Operator, robot: Robot, reached: Callable[[Status], bool], up: float = 0.6) -> Status:
    """Hold the stick, and go on holding it; returns when the robot drives.

    Args:
        operator: whose mouse goes down on the stick of their page.
        robot: that they drive.
        reached: whether it drives as wanted.
        up: how far the stick is pushed, in parts of its way.
    """
    for _ in range(TRIES):
        operator.take_seat()
        operator.pulls(".stick", right=0.0, up=up)
        try:
            return robot.comes_to(reached, WITHIN_S)
        except AssertionError:
            assert TOLD_TO in operator.text("#notes"), "the page let go without a word"
            operator.page.mouse.up()
    raise AssertionError(f"the page let go {TRIES} times: {operator.text('#notes')}")
