"""What the simulated devices know of the physical world: motor shafts, headings of wheel pairs, steering brakes.

A drive's twin puts itself on an :class:`Axis` as its torque source; an encoder's twin reads a heading; a brake's twin
engages and releases. Whoever changes what a source will demand, or a brake, first brings the world up to that moment
with :meth:`World.advance`, so that the past is computed with the past's commands.
"""

from __future__ import annotations

from typing import Protocol

STEP_S = 0.001
"""Integration step of every world [s]."""


class TorqueSource(Protocol):
    """A power stage with its regulators, as the motor sees it."""

    def current_demand(self, speed_rad_s: float, position_rad: float, dt_s: float) -> float:
        """Demand of motor current [A] for the coming step.

        Asked exactly once a step, moving or not, so a source may integrate ramps, regulators and temperatures in it.

        Args:
            speed_rad_s: speed of the motor shaft.
            position_rad: angle of the motor shaft, unwrapped.
            dt_s: length of the step.

        Returns:
            The demanded current; 0.0 with the power stage off. Supply voltage and back-EMF limit what flows.
        """
        ...


class Axis:
    """One motor shaft with its encoder."""

    __slots__ = ("ahead_s", "current_a", "position_rad", "speed_rad_s", "torque_source")

    def __init__(self, position_rad: float = 0.0) -> None:
        self.position_rad = position_rad
        """Angle of the motor shaft, unwrapped."""
        self.speed_rad_s = 0.0
        self.ahead_s = 0.0
        """Time by which the world's present is ahead of ``position_rad``: less than a step."""
        self.current_a = 0.0
        """Current that flows in the motor."""
        self.torque_source: TorqueSource | None = None
        """None costs nothing: a world at rest without any source skips time in one go."""


class World(Protocol):
    """The physics behind a simulated network."""

    axes: dict[str, Axis]
    """Motor shafts by the profile's names of the drives."""

    @property
    def moving(self) -> bool:
        """False while everything is at rest and every torque source repeats its demand, as far as advanced."""
        ...

    def advance(self, now_s: float) -> None:
        """Integrate up to ``now_s`` in fixed steps; the first call sets the origin of time.

        The result depends on the times only, not on the number of calls. Rest without a torque source is skipped in
        one go; rest with sources only asks them.
        """
        ...

    def heading_rad(self, pair: str) -> float:
        """Heading of a wheel pair relative to the body, counter-clockwise positive, by its encoder's name."""
        ...

    def set_brake(self, name: str, engaged: bool) -> None:
        """Engage or release a brake, by its name in the profile, from the last advanced time on."""
        ...
