"""A PID regulator in discrete time, as simple as the ENPM808X report's: sums and differences of the error."""

from __future__ import annotations

from dataclasses import dataclass

from daemon.loops.geometry import clamp


@dataclass(frozen=True, slots=True)
class PidGains:
    """Gains of the error, its integral and its derivative."""

    proportional: float
    integral: float = 0.0
    derivative: float = 0.0


class Pid:
    """A regulator with a limited output.

    Attributes:
        integral: of the error over time.
    """

    def __init__(self, gains: PidGains, limit: float, anti_windup: bool = True) -> None:
        """A regulator at rest.

        Args:
            gains: of the three terms.
            limit: of the output, to both sides.
            anti_windup: do not integrate an error that only presses the output further against its limit. The report
                has no such thing.
        """
        self._gains, self._limit, self._anti_windup = gains, limit, anti_windup
        self.integral = 0.0
        self._last: float | None = None

    def step(self, error: float, dt: float) -> float:
        """The output for an error; the derivative is that of the error, 0 in the first step."""
        gains = self._gains
        rate = 0.0 if self._last is None else (error - self._last) / dt
        self._last = error
        integral = self.integral + error * dt
        wanted = gains.proportional * error + gains.integral * integral + gains.derivative * rate
        output = clamp(wanted, self._limit)
        if not (self._anti_windup and gains.integral * error * (wanted - output) > 0):
            self.integral = integral
        return output
