"""Profile generators and the regulator of the simulated EPOS 24/5, in steps of time; rad, s, A throughout.

Sources: maxon EPOS Firmware Specification chapter 9 (trapezoidal profiles) and 14.1.83 (0x6410, current limits). The
manual gives no regulator gains in physical units; they are assumed here as a commissioning under load would leave them:
the velocity loop is designed for ten times the rotor's inertia at 40 rad/s with damping 1, so a lighter load only damps
it more. Objects 0x60F6, 0x60F9 and 0x60FB are stored and do not change this.
"""

from __future__ import annotations

from math import copysign, exp, sqrt

from profiles.schema import Motor

_BANDWIDTH_RAD_S = 40.0
_DAMPING = 1.0
_LOAD_FACTOR = 10.0
_POSITION_GAIN_PER_S = 10.0
_COOLED = 0.9
"""Share of the continuous current's heat below which the output current limit is allowed again (assumed)."""
_SAME_RAD = 1e-9


class SpeedRamp:
    """A speed that runs to its target at limited acceleration.

    Attributes:
        speed: present value [rad/s].
        slope: acceleration of the last step [rad/s2].
        target: value to reach [rad/s].
        up, down: rates away from zero and towards zero [rad/s2].
    """

    __slots__ = ("down", "slope", "speed", "target", "up")

    def __init__(self) -> None:
        self.speed = self.slope = self.target = self.up = self.down = 0.0

    def aim(self, target: float, up: float, down: float) -> None:
        """Set target and rates."""
        self.target, self.up, self.down = target, up, down

    def step(self, dt_s: float) -> None:
        """Run on by one step."""
        speed, target = self.speed, self.target
        faster = speed * target >= 0.0 and abs(target) > abs(speed)
        change = (self.up if faster else self.down) * dt_s
        new = min(speed + change, target) if target > speed else max(speed - change, target)
        self.slope = (new - speed) / dt_s
        self.speed = new


class PositionProfile:
    """A position that runs to its end by a trapezoidal speed.

    Attributes:
        position: present value [rad].
        speed, slope: its derivatives [rad/s, rad/s2].
        end: where to go [rad].
        top: speed limit [rad/s]; 0 brings it to a halt wherever it is.
        up, down: acceleration and deceleration [rad/s2].
        arrived: the end is reached.
    """

    __slots__ = ("arrived", "down", "end", "position", "slope", "speed", "top", "up")

    def __init__(self) -> None:
        self.position = self.speed = self.slope = self.end = self.top = self.up = self.down = 0.0
        self.arrived = True

    def aim(self, end: float, top: float, up: float, down: float) -> None:
        """Start a move from the present position and speed."""
        self.end, self.top, self.up, self.down = end, top, up, down
        self.arrived = False

    def step(self, dt_s: float, *, halted: bool) -> None:
        """Run on by one step.

        The speed follows the braking curve ``v = sqrt(2 a d)``, taken at the end of the step, so that it reaches the
        end without overshoot.
        """
        speed, way, braking = self.speed, self.end - self.position, self.down * dt_s
        curve = sqrt(0.25 * braking * braking + 2.0 * self.down * abs(way)) - 0.5 * braking
        wanted = 0.0 if halted or self.arrived else copysign(min(self.top, curve), way)
        faster = speed * wanted >= 0.0 and abs(wanted) > abs(speed)
        change = (self.up if faster else self.down) * dt_s
        new = min(speed + change, wanted) if wanted > speed else max(speed - change, wanted)
        reaching = 0.0 < abs(way) <= abs(new) * dt_s and abs(new) <= 1.01 * braking
        if reaching and not (halted or self.arrived):
            self.position, new = self.end, way / dt_s
        elif new == 0.0 and abs(way) < _SAME_RAD:
            self.position, self.arrived = self.end, True
        else:
            self.position += new * dt_s
        self.slope = (new - speed) / dt_s
        self.speed = new


class Regulator:
    """Speed and position regulator with the current limit of the winding.

    Args:
        motor: the motor that is mounted.

    Attributes:
        continuous_a, output_a: limits of object 0x6410.
        winding_s: thermal time constant of the winding (0x6410/5).
        limited: the winding is as warm as the continuous current makes it.
    """

    __slots__ = (
        "_feed_forward",
        "_heat_a2",
        "_i_gain",
        "_integral_a",
        "_p_gain",
        "continuous_a",
        "limited",
        "output_a",
        "winding_s",
    )

    def __init__(self, motor: Motor) -> None:
        inertia_per_torque = _LOAD_FACTOR * motor.rotor_inertia_kg_m2 / motor.torque_constant_n_m_a
        self._feed_forward = inertia_per_torque
        self._p_gain = 2.0 * _DAMPING * _BANDWIDTH_RAD_S * inertia_per_torque
        self._i_gain = _BANDWIDTH_RAD_S * _BANDWIDTH_RAD_S * inertia_per_torque
        self._integral_a = self._heat_a2 = 0.0
        self.continuous_a = self.output_a = 0.0
        self.winding_s = motor.thermal_time_constant_s
        self.limited = False

    def restart(self, off_s: float) -> None:
        """Forget the integral part, and let the winding cool for the time that the power stage was off."""
        self._integral_a = 0.0
        self._heat_a2 *= exp(-off_s / self.winding_s)

    def follow_speed(self, demand: float, slope: float, speed: float, dt_s: float) -> float:
        """Current [A] that makes the shaft follow a speed demand and its slope (PI with acceleration feed-forward)."""
        error = demand - speed
        current = self._p_gain * error + self._integral_a + self._feed_forward * slope
        limited = self.limit(current, dt_s)
        if limited == current:
            self._integral_a += self._i_gain * error * dt_s
        return limited

    def speed_for(self, error_rad: float) -> float:
        """Speed [rad/s] that the position regulator adds for a position error."""
        return _POSITION_GAIN_PER_S * error_rad

    def limit(self, current: float, dt_s: float) -> float:
        """A demand [A] within the output limit, or the continuous one while the winding is warm (one thermal mass)."""
        heat, most = self._heat_a2, self.output_a
        if self.limited or heat >= self.continuous_a * self.continuous_a:
            most = self._most_while_warm()
        if current > most:
            current = most
        elif current < -most:
            current = -most
        self._heat_a2 = heat + (current * current - heat) * dt_s / self.winding_s
        return current

    def _most_while_warm(self) -> float:
        """The limit [A] of a winding that has become warm, until it has cooled."""
        warm = self.continuous_a * self.continuous_a
        self.limited = self._heat_a2 >= (_COOLED * warm if self.limited else warm)
        return min(self.continuous_a, self.output_a) if self.limited else self.output_a
