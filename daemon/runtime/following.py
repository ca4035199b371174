"""How a vehicle stands to the path that it follows, for ``status`` and for the rows of a run."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

from daemon.loops.path_driving import ErrorLimits

NO_LIMITS: Final = ErrorLimits(math.inf, math.inf, None)


@dataclass(frozen=True, slots=True)
class Following:
    """Errors beside a path, all positive to the left, and the limits at which the motion ends.

    Attributes:
        progress_m: way along the path.
        length_m: of the path.
        error_m: of the reference point, from the path.
        heading_error_rad: of the vehicle, or of its trailer where that is followed.
        bending_error_rad: against the bending angle that the path asks for; None without a trailer.
        backward: driving direction.
        limits: infinite where nothing ends the motion.
    """

    progress_m: float
    length_m: float
    error_m: float
    heading_error_rad: float
    bending_error_rad: float | None
    backward: bool
    limits: ErrorLimits

    def told(self) -> dict[str, Any]:
        """For ``status``."""
        errors, limits = self.errors(), self.error_limits()
        return {
            "progress_m": round(self.progress_m, 3),
            "length_m": round(self.length_m, 3),
            **dict(zip(_ERRORS, errors, strict=True)),
            "backward": self.backward,
            "limits": dict(zip(_ERRORS, limits, strict=True)),
        }

    def errors(self) -> tuple[float | None, float | None, float | None]:
        """Position [m], heading and bending angle [degrees], rounded."""
        return _rounded(self.error_m, self.heading_error_rad, self.bending_error_rad)

    def error_limits(self) -> tuple[float | None, float | None, float | None]:
        """Limits of the errors likewise; None where there is none."""
        return _rounded(*self.limits)


_ERRORS: Final = ("error_m", "heading_error_deg", "bending_error_deg")
COLUMNS: Final = ("error_m", "heading_error_deg", "bending_error_deg",
                  "error_limit_m", "heading_error_limit_deg", "bending_error_limit_deg")  # fmt: skip
"""Of a run's table: errors and their limits."""


def _rounded(
    position_m: float, heading_rad: float, bending_rad: float | None
) -> tuple[float | None, float | None, float | None]:
    return (_number(position_m, 4), _degrees(heading_rad), None if bending_rad is None else _degrees(bending_rad))


def _degrees(angle_rad: float) -> float | None:
    return _number(math.degrees(angle_rad), 3)


def _number(value: float, digits: int) -> float | None:
    return round(value, digits) + 0.0 if math.isfinite(value) else None  # not -0.0
