"""The dead-man button: when a pad may drive. Pure."""

from __future__ import annotations


class DeadMan:
    """Locked at first, and after everything that stops the robot.

    A pad drives from the moment at which its button is held with all sticks in their middle, if the button was let go
    of since the lock, and as long as it is held.

    Attributes:
        driving: whether the sticks count.
        centring: whether it would drive but for a stick that is not in its middle.
    """

    def __init__(self) -> None:
        self.driving = False
        self.centring = False
        self._released = False

    def lock(self) -> None:
        """Drive no more before the button was let go of and pressed again."""
        self.driving = self.centring = self._released = False

    def step(self, *, held: bool, neutral: bool) -> None:
        """What the pad says now.

        Args:
            held: the button is pressed and was not let go of since the last step.
            neutral: all sticks are in their middle.
        """
        self._released = self._released or not held
        self.driving = held and self._released and (self.driving or neutral)
        self.centring = held and self._released and not self.driving
