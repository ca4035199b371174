"""A motor with its gear and wheel: current, torque, losses, rotation.

Motor (maxon, *The selection of high-precision microdrives*, basic equations), electrical time constant neglected::

    |k w + R i| <= U     limits the current that the power stage can drive      M = k i

Gear and wheel, all torques at the wheel, ``n`` motor turns a wheel turn, ``T = n k i`` the drive's torque::

    (I_wheel + n**2 I_rotor) dW/dt = T - r F_x - friction

``friction`` is dry and opposes the rotation: the motor's no-load torque, rolling resistance ``c r F_z``, and the
gear's loss. A gear of efficiency ``eta`` loses ``(1 - eta) |T|`` when the motor drives, and ``(1/eta - 1) |T|`` when
the wheel drives the motor. Dry friction is applied as an impulse that at most stops the wheel, so a wheel comes to rest
exactly, and starts only when something stronger than friction pulls.
"""

from __future__ import annotations

from math import inf, pi

from drivers.simulated.world import Axis
from profiles.schema import DriveConfig, SimulationConfig


class WheelDrive:
    """Motor, gear and wheel of one drive; its motor shaft is the ``axis`` that the drive's twin sees.

    Args:
        config: the drive of the profile.
        simulation: supply voltage, wheel inertia, rolling resistance.
        phase: where within one quad count the encoder stands at the start, 0 to 1.
    """

    __slots__ = (
        "_back_loss",
        "_blocked",
        "_brake_n_m",
        "_dry_n_m",
        "_forward_loss",
        "_friction_n_m",
        "_per_inertia",
        "_radius_m",
        "_resistance_ohm",
        "_rolling_m",
        "_shaft_per_wheel",
        "_supply_v",
        "_torque_constant",
        "_wheel_torque_per_a",
        "axis",
        "braked",
        "demand_a",
        "rim_m_s",
        "wheel_rad_s",
    )

    def __init__(self, config: DriveConfig, simulation: SimulationConfig, phase: float = 0.0) -> None:
        motor, ratio = config.motor, config.total_ratio
        self.axis = Axis(position_rad=phase * 2.0 * pi / config.qc_per_motor_turn)
        self.demand_a = 0.0
        self.wheel_rad_s = 0.0
        """Speed of the wheel, positive when it rolls forward."""
        self.rim_m_s = 0.0
        self._radius_m = config.wheel_radius_m
        self._supply_v = simulation.supply_voltage_v
        self._resistance_ohm = motor.resistance_ohm
        self._torque_constant = motor.torque_constant_n_m_a
        self._shaft_per_wheel = config.direction * ratio
        self._wheel_torque_per_a = config.direction * ratio * motor.torque_constant_n_m_a
        self._per_inertia = 1.0 / (simulation.wheel_inertia_kg_m2 + ratio * ratio * motor.rotor_inertia_kg_m2)
        self._friction_n_m = ratio * motor.torque_constant_n_m_a * motor.no_load_current_a
        self._brake_n_m = simulation.brake_holding_torque_n_m
        self._dry_n_m = self._friction_n_m
        self.braked = self._blocked = False
        self._rolling_m = simulation.tyre.rolling_resistance * config.wheel_radius_m
        self._forward_loss = 1.0 - config.gear_efficiency
        self._back_loss = 1.0 / config.gear_efficiency - 1.0

    def ask(self, dt_s: float) -> bool:
        """Ask the torque source for its demand in the coming step; True when it differs from the last one."""
        axis = self.axis
        source = axis.torque_source
        demand = 0.0 if source is None else source.current_demand(axis.speed_rad_s, axis.position_rad, dt_s)
        changed = demand != self.demand_a
        self.demand_a = demand
        return changed

    def turn(self, contact_force_n: float, load_n: float, dt_s: float) -> None:
        """Turn motor and wheel for one step.

        Args:
            contact_force_n: force of the floor on the wheel along its heading.
            load_n: wheel load.
            dt_s: length of the step.
        """
        axis = self.axis
        current, shaft = self.demand_a, axis.speed_rad_s
        voltage = self._torque_constant * shaft + self._resistance_ohm * current
        if not -self._supply_v <= voltage <= self._supply_v:
            current = self._flowing(shaft)
        axis.current_a = current
        torque = self._wheel_torque_per_a * current
        speed = self.wheel_rad_s
        loss = (self._forward_loss if torque * speed >= 0.0 else self._back_loss) * torque
        friction = self._dry_n_m + self._rolling_m * load_n + (loss if loss >= 0.0 else -loss)
        step = dt_s * self._per_inertia
        speed += (torque - self._radius_m * contact_force_n) * step
        stopping = friction * step
        if speed > stopping:
            speed -= stopping
        elif speed < -stopping:
            speed += stopping
        else:
            speed = 0.0
        self.wheel_rad_s = speed
        self.rim_m_s = self._radius_m * speed
        shaft = axis.speed_rad_s = self._shaft_per_wheel * speed
        axis.position_rad += shaft * dt_s

    def follow(self, wheel_rad_s: float, dt_s: float) -> None:
        """Turn for one step as a hand at the wheel does."""
        self.wheel_rad_s = wheel_rad_s
        self.rim_m_s = self._radius_m * wheel_rad_s
        self.axis.current_a = 0.0
        self.axis.speed_rad_s = self._shaft_per_wheel * wheel_rad_s
        self.axis.position_rad += self.axis.speed_rad_s * dt_s

    @property
    def wheel_rad(self) -> float:
        """Angle of the wheel, unwrapped, positive as it rolls forward."""
        return self.axis.position_rad / self._shaft_per_wheel

    def _flowing(self, shaft_rad_s: float) -> float:
        """Current [A] that supply voltage and back-EMF let flow for a demand that they cannot meet.

        Beyond the no-load speed the power stage's diodes conduct: current brakes the motor whatever is demanded.
        """
        back_emf = self._torque_constant * shaft_rad_s
        most = (self._supply_v - back_emf) / self._resistance_ohm
        least = (-self._supply_v - back_emf) / self._resistance_ohm
        demand = self.demand_a
        return least if demand < least else most if demand > most else demand

    def set_brake(self, engaged: bool) -> None:
        """Engage or release a holding brake on the wheel."""
        self.braked = engaged
        self._hold()

    def block(self, blocked: bool) -> None:
        """Let something jam the motor, so that nothing turns it, or take it away."""
        self._blocked = blocked
        self._hold()

    def _hold(self) -> None:
        braked_n_m = self._brake_n_m if self.braked else 0.0
        self._dry_n_m = inf if self._blocked else self._friction_n_m + braked_n_m

    def stop(self) -> None:
        """Bring the wheel to rest at once."""
        self.wheel_rad_s = self.rim_m_s = self.axis.speed_rad_s = 0.0
