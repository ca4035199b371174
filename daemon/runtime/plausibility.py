"""The checks of a vehicle while it moves, and what a person is told of a contradiction."""

from __future__ import annotations

import math

from canhelm.errors import DeviceFault
from daemon.loops.measurement import Command, Measurement
from daemon.loops.plausibility import AxisTurning, EncoderJumps, Turning
from daemon.loops.plausibility_limits import encoder_rates_rad_s, jump_margins_rad, steered_axes, turning_limits_rad
from daemon.runtime.vehicle import Vehicle
from drivers.contract import Fault

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

    def look(
        self, measurement: Measurement, command: Command, dt_s: float, *, powered: bool, driving: bool
    ) -> DeviceFault | None:
        """The contradiction that stops the vehicle, or None.

        Args:
            measurement: of this cycle.
            command: that was sent before it.
            dt_s: for which it was sent.
            powered: whether anything has power; what happens without is not looked at.
            driving: whether a law of the vehicle moves it; a person who moves single motors knows what stands against.
        """
        if not powered:
            self._jumps.begin_anew()
        jump = powered and self._jumps.look(
            measurement.heading_rad[: len(self._encoders)], [encoder.reading_time_s for encoder in self._encoders]
        )
        if jump:
            return self._fault(jump.index, "jumped", jump.value, jump.limit, _JUMP_REMEDY)
        return self._turned(measurement, command, dt_s, powered and driving)

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
                return self._fault(axis.encoder, _TURNS[how], value, limit, _TURN_REMEDIES[how])
        return None

    def _fault(self, index: int, does: str, off_rad: float, limit_rad: float, remedy: str) -> DeviceFault:
        """A fault of an encoder that is off by an angle; it stays the encoder's until the reset."""
        encoder = self._encoders[index]
        node, name = encoder.node, encoder.name
        value, limit = round(math.degrees(off_rad), 2), round(math.degrees(limit_rad), 2)
        told = f"the encoder of node {node} ({name}) {does}: off by {value:g} deg, at most {limit:g} deg can be true"
        encoder.fault = Fault(name, node or 0, 0, told, remedy)
        return DeviceFault(told, node=node, value=value, limit=limit, remedy=remedy)
