"""A tyre's contact patch: bristles that bend, creep out of the patch as the wheel rolls, and slide.

The bristles' mean deflection ``(x, y)`` [m] along and left of the wheel's heading grows with the slip velocity and is
carried out of the patch by rolling (Pacejka, *Tyre and Vehicle Dynamics*, ch. 7,
single-contact-point transient model)::

    dx/dt = s_x - |u| x / sigma_x        s_x = u - v_roll      u: speed of the rim
    dy/dt = s_y - |u| y / sigma_y        s_y =   - v_lat

so that a wheel that rolls steadily has ``x = sigma_x s_x/|u|``: deflection over relaxation length is the slip. At
standstill the same equations make a spring, which is what holds a robot on the spot. The bristles are equally stiff in
both directions, ``k = C_y F_z / sigma_y``, hence ``sigma_x = sigma_y C_x / C_y``. The force follows the brush model
with a parabolic pressure distribution (ibid., ch. 3)::

    F = k d (1 - q + q**2/3),   q = k |d| / (3 mu F_z),   |F| = mu F_z for q >= 1

which couples both directions and never exceeds friction. ``d`` is the deflection plus ``DAMPING_S`` times its rate: the
rubber's damping, without which a robot at rest would swing for ever. It vanishes in steady rolling.

Rolling out is integrated implicitly and the spring with the newest deflection, so a step stays stable from standstill
to any speed.
"""

from __future__ import annotations

from math import atan, inf, sqrt

from canhelm.errors import ConfigError
from profiles.schema import Tyre

DAMPING_S = 0.006
"""Ratio of the rubber's damping to its stiffness (assumed: about a third of critical for a wheel on its bristles)."""
SLOWEST_REFERENCE_M_S = 0.05
"""Speed below which slip is reported relative to this speed, since the ratio means nothing near standstill."""


def require_soft(tyre: Tyre, stiffness_n: float, mobility_per_kg: float, step_s: float) -> None:
    """Refuse tyres that an integration step cannot follow.

    A mass 1/M on a spring k with the damping tau k, integrated as here in steps h, is stable for
    ``k M h (h + 2 tau) < 4``; 3 leaves room for the shift of load.

    Args:
        tyre: of the profile.
        stiffness_n: force per slip, at the wheel's load; over the relaxation length it is the spring.
        mobility_per_kg: acceleration per force of what the tyre pulls at.
        step_s: the step.

    Raises:
        ConfigError: their relaxation length is too short.
    """
    least_m = stiffness_n * mobility_per_kg * step_s * (step_s + 2.0 * DAMPING_S) / 3.0
    if tyre.relaxation_length_m < least_m:
        raise ConfigError(
            f"the simulated tyres are too stiff for steps of {1000.0 * step_s:g} ms",
            object="simulation.tyre.relaxation_length_m",
            value=tyre.relaxation_length_m,
            limit=least_m,
            remedy=f"set a relaxation length of at least {least_m:.4f} m, or a smaller slip or cornering stiffness",
        )


class Contact:
    """One tyre on the floor. The forces act on the wheel, along its heading and to its left."""

    __slots__ = (
        "_deflection_x",
        "_deflection_y",
        "_friction",
        "_ice",
        "_lateral_m_s",
        "_limit_m",
        "_rim_m_s",
        "_roll_m_s",
        "_roll_out_x",
        "_roll_out_y",
        "_stiffness",
        "force_x_n",
        "force_y_n",
    )

    def __init__(self, tyre: Tyre) -> None:
        stiffness = tyre.cornering_stiffness_per_rad / tyre.relaxation_length_m
        self._stiffness = stiffness
        self._limit_m = 0.0
        self._ice = inf
        self.stand_on(tyre.friction)
        self._roll_out_x = stiffness / tyre.slip_stiffness
        self._roll_out_y = stiffness / tyre.cornering_stiffness_per_rad
        self._deflection_x = 0.0
        self._deflection_y = 0.0
        self.force_x_n = 0.0
        self.force_y_n = 0.0
        self._rim_m_s = self._roll_m_s = self._lateral_m_s = 0.0

    def stand_on(self, friction: float) -> None:
        """From now on the floor has this coefficient of friction."""
        self._friction = friction
        self._limit_m = 3.0 * min(friction, self._ice) / self._stiffness

    def lay_ice(self, friction: float) -> None:
        """From now on there is at most this friction, whatever the floor has; infinity takes the ice away."""
        self._ice = friction
        self.stand_on(self._friction)

    @property
    def slip_ratio(self) -> float:
        """(rim speed - rolling speed) over the faster of the two, in the last step."""
        reference = max(abs(self._rim_m_s), abs(self._roll_m_s), SLOWEST_REFERENCE_M_S)
        return (self._rim_m_s - self._roll_m_s) / reference

    @property
    def slip_m_s(self) -> float:
        """Rim speed less rolling speed, in the last step."""
        return self._rim_m_s - self._roll_m_s

    @property
    def slip_angle_rad(self) -> float:
        """Angle from the wheel's heading to the motion of its contact point, positive to the left, in the last step."""
        return atan(self._lateral_m_s / max(abs(self._roll_m_s), SLOWEST_REFERENCE_M_S))

    def deform(self, rim_m_s: float, roll_m_s: float, lateral_m_s: float, load_n: float, dt_s: float) -> None:
        """Bend the bristles for one step and update the forces.

        Args:
            rim_m_s: speed of the rim, ``radius * wheel speed``.
            roll_m_s: velocity of the contact point along the wheel's heading.
            lateral_m_s: velocity of the contact point to the left of the heading.
            load_n: wheel load.
            dt_s: length of the step.
        """
        rolled = rim_m_s * dt_s if rim_m_s >= 0.0 else -rim_m_s * dt_s
        old_x = self._deflection_x
        old_y = self._deflection_y
        x = (old_x + (rim_m_s - roll_m_s) * dt_s) / (1.0 + rolled * self._roll_out_x)
        y = (old_y - lateral_m_s * dt_s) / (1.0 + rolled * self._roll_out_y)
        damping = DAMPING_S / dt_s
        bent_x = x + (x - old_x) * damping
        bent_y = y + (y - old_y) * damping
        q = sqrt(bent_x * bent_x + bent_y * bent_y) / self._limit_m
        if q < 1.0:
            stiffness = load_n * self._stiffness * (1.0 - q + q * q / 3.0)
        else:
            stiffness = load_n * self._stiffness / (3.0 * q)
            x, y = self._slide(x, y)
        self.force_x_n = stiffness * bent_x
        self.force_y_n = stiffness * bent_y
        self._deflection_x = x
        self._deflection_y = y
        self._rim_m_s, self._roll_m_s, self._lateral_m_s = rim_m_s, roll_m_s, lateral_m_s

    def _slide(self, x: float, y: float) -> tuple[float, float]:
        """Bristles bent beyond the limit slide back to it."""
        excess = sqrt(x * x + y * y) / self._limit_m
        return (x / excess, y / excess) if excess > 1.0 else (x, y)
