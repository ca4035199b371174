"""The checks of a vehicle while it moves, and what a person is told of a contradiction."""

from __future__ import annotations

import math
from functools import partial
from typing import Final

from canhelm.errors import DeviceFault
from daemon.loops.least_squares import Fits
from daemon.loops.measurement import Command, Measurement
from daemon.loops.motor_current import CurrentAndMotion, Misfit, current_limits
from daemon.loops.plausibility import AxisTurning, EncoderJumps, Turning
from daemon.loops.plausibility_limits import encoder_rates_rad_s, jump_margins_rad, steered_axes, turning_limits_rad
from daemon.loops.wheels_and_body import WheelsAndBody, rows_of, wheel_limit_m, wheels_of
from daemon.runtime.vehicle import Vehicle
from drivers.contract import Device, Drive, Fault

_TURNS = {
    Turning.STANDS: "stands while its wheels turn its axis",
    Turning.AGAINST: "turns against its command",
    Turning.OFF: "turns otherwise than its wheels turn its axis",
}
_TURN_REMEDIES = {
    Turning.STANDS: "does its axis turn? then check the encoder's coupling, else its brake, and where its wheels slip",
    Turning.AGAINST: "check the directions of the encoder and of the drives in the profile: `canhelm setup`",
    Turning.OFF: "check the encoder's coupling and counts_per_turn, and whether the wheels slip",
}
_JUMP_REMEDY = (
    "check the encoder's coupling, cable and shield; before the reset, compare `canhelm encoder status` with where the "
    "wheels point"
)

_WHEEL_REMEDY = "is the wheel blocked, does it slip, or is its belt off? else check the motor's encoder and cable"
_MISFIT_REMEDIES = {
    Misfit.IN_VAIN: "is its wheel, gear or brake blocked, or does it push something? else check the motor's encoder",
    Misfit.NONE: "check the motor's cable and plugs; is its shaft or belt loose?",
}


OLD_CURRENT_MODE: Final = "expiring_position"
"""Of the drive that a serial line is plugged into: its current is read once in eight rounds, too seldom to judge."""


class Plausibility:
    """Looks at each cycle's readings while anything has power.

    Args:
        vehicle: whose readings; its limits come from its profile.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        profile = vehicle.profile
        rates_rad_s = encoder_rates_rad_s(profile)
        self._encoders = vehicle.encoders[: len(rates_rad_s)]
        names = tuple(encoder.name for encoder in self._encoders)
        self._jumps = EncoderJumps(rates_rad_s, jump_margins_rad(profile, names), 1.0 / profile.network.cycle_hz)
        limits_rad = turning_limits_rad(profile, names)
        self._axes = tuple((axis, AxisTurning(limits_rad[axis.encoder])) for axis in steered_axes(profile))
        self._vehicle, self._drives = vehicle, vehicle.drives
        self._body, self._wheels = WheelsAndBody(wheel_limit_m(profile)), wheels_of(profile)
        self._fits = Fits(partial(rows_of, profile))
        self._currents = tuple(
            (index, config.direction, CurrentAndMotion(current_limits(profile, config)))
            for index, drive in enumerate(vehicle.drives)
            if (config := profile.drives.get(drive.name)) and config.mode != OLD_CURRENT_MODE
        )

    def jumped(self, measurement: Measurement, *, powered: bool) -> DeviceFault | None:
        """The encoder that tells what no axis can do within a cycle, or None; ask before any law hears of it.

        Args:
            measurement: of this cycle.
            powered: whether anything has power; what happens without is not looked at.
        """
        if not powered:
            self._jumps.begin_anew()
            return None
        headings_rad = measurement.heading_rad[: len(self._encoders)]
        jump = self._jumps.look(headings_rad, [encoder.reading_time_s for encoder in self._encoders])
        return self._off(jump.index, "jumped", jump.value, jump.limit, _JUMP_REMEDY) if jump else None

    def look(self, measurement: Measurement, command: Command, dt_s: float, *, driving: bool) -> DeviceFault | None:
        """The contradiction that stops the vehicle, or None.

        Args:
            measurement: of this cycle.
            command: that was sent before it.
            dt_s: for which it was sent.
            driving: whether a law of the vehicle moves it; a person who moves single motors knows what stands against.
        """
        return (
            self._turned(measurement, command, dt_s, driving)
            or self._rolled(measurement, command, dt_s, driving)
            or self._pulled(measurement, command, dt_s, driving)
        )

    def _turned(self, measurement: Measurement, command: Command, dt_s: float, driving: bool) -> DeviceFault | None:
        """The first axis that turns otherwise than its wheels turn it."""
        for axis, check in self._axes:
            free = axis.brake is None or (any(command.release_brake) and measurement.brake_released[axis.brake])
            if not (driving and free):
                check.begin_anew()
                continue
            heading = measurement.heading_rad[axis.encoder]
            commanded = axis.angle(command.wheel_speed_m_s) * dt_s
            found = check.look(heading, axis.angle(measurement.wheel_travel_m), commanded)
            if found:
                how, value, limit = found
                return self._off(axis.encoder, _TURNS[how], value, limit, _TURN_REMEDIES[how])
        return None

    def _rolled(self, measurement: Measurement, command: Command, dt_s: float, driving: bool) -> DeviceFault | None:
        """The wheel that rolls otherwise than the body can move above it; a pair that is being turned is left out."""
        if not (driving and all(measurement.brake_engaged)):
            self._body.begin_anew()
            return None
        fit = self._fits.at(measurement.heading_rad)
        if not fit.rows:
            return None
        wheels = self._wheels
        commanded_m_s = command.wheel_speed_m_s[:wheels]
        found = self._body.look(fit, measurement.wheel_travel_m[:wheels], commanded_m_s, dt_s)
        if found is None:
            return None
        drive, off, limit = self._drives[found.index], round(found.value, 4), round(found.limit, 4)
        told = f"node {drive.node} ({drive.name}) rolls otherwise than the body moves: the wheels are off by {off:g} m"
        return _fault(drive, f"{told}, at most {limit:g} m can be true", off, limit, _WHEEL_REMEDY)

    def _pulled(self, measurement: Measurement, command: Command, dt_s: float, driving: bool) -> DeviceFault | None:
        """The first motor whose current does not fit the motion of its wheel; a robot that pushes something is let."""
        driving = driving and not self._vehicle.pushing
        for index, direction, check in self._currents:
            if not driving:
                check.begin_anew()
                continue
            drive = self._drives[index]
            speed_m_s, commanded_m_s = measurement.wheel_speed_m_s[index], command.wheel_speed_m_s[index]
            misfit = check.look(direction * drive.current_a, speed_m_s, commanded_m_s, dt_s)
            if misfit:
                return _misfit(drive, misfit, check, f"{round(speed_m_s, 2) + 0.0:.2f} m/s of {commanded_m_s:.2f} m/s")
        return None

    def _off(self, index: int, does: str, off_rad: float, limit_rad: float, remedy: str) -> DeviceFault:
        """A fault of an encoder that is off by an angle."""
        encoder = self._encoders[index]
        value, limit = round(math.degrees(off_rad), 2), round(math.degrees(limit_rad), 2)
        told = f"the encoder of node {encoder.node} ({encoder.name}) {does}: off by {value:g} deg"
        return _fault(encoder, f"{told}, at most {limit:g} deg can be true", value, limit, remedy)


def _misfit(drive: Drive, how: Misfit, check: CurrentAndMotion, rim: str) -> DeviceFault:
    """A fault of a motor; ``rim`` is what its wheel does of what it shall do."""
    in_vain, current_a = how is Misfit.IN_VAIN, round(abs(drive.current_a), 2)
    limit_a = round(check.limits.strong_a if in_vain else check.limits.weak_a, 3)
    does = f"has {current_a:g} A in vain" if in_vain else f"moves without current ({current_a:g} A)"
    told = f"the motor of node {drive.node} ({drive.name}) {does}: its wheel turns at {rim} (limit: {limit_a} A)"
    return _fault(drive, told, current_a, limit_a, _MISFIT_REMEDIES[how])


def _fault(device: Device, told: str, value: float, limit: float, remedy: str) -> DeviceFault:
    """A device's fault, and its own until the reset."""
    device.fault = Fault(device.name, device.node or 0, 0, told, remedy)
    return DeviceFault(told, node=device.node, value=value, limit=limit, remedy=remedy)
