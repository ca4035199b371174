"""The checks of a vehicle while it moves, and what a person is told of a contradiction."""

from __future__ import annotations

import math

from canhelm.errors import DeviceFault
from daemon.loops.measurement import Measurement
from daemon.loops.plausibility import Contradiction, EncoderJumps
from daemon.loops.plausibility_limits import encoder_rates_rad_s, jump_margins_rad
from daemon.runtime.vehicle import Vehicle


class Plausibility:
    """Looks at each cycle's readings while anything has power.

    Args:
        vehicle: whose readings; its limits come from its profile.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        profile = vehicle.profile
        self._encoders = vehicle.encoders[: len(encoder_rates_rad_s(profile))]
        names = tuple(encoder.name for encoder in self._encoders)
        period_s = 1.0 / profile.network.cycle_hz
        self._jumps = EncoderJumps(encoder_rates_rad_s(profile), jump_margins_rad(profile, names), period_s)

    def look(self, measurement: Measurement, *, powered: bool) -> DeviceFault | None:
        """The contradiction that stops the vehicle, or None; what happens without power begins anew with it."""
        if not powered:
            self._jumps.begin_anew()
            return None
        jump = self._jumps.look(
            measurement.heading_rad[: len(self._encoders)], [encoder.reading_time_s for encoder in self._encoders]
        )
        return self._jumped(jump) if jump else None

    def _jumped(self, jump: Contradiction) -> DeviceFault:
        encoder = self._encoders[jump.index]
        return _fault(
            encoder.node,
            f"the angle of node {encoder.node} ({encoder.name}) jumped by",
            jump,
            "check the encoder's coupling, cable and shield; before the reset, compare `canhelm encoder status` with "
            "where the wheels point",
        )


def _fault(node: int | None, what: str, found: Contradiction, remedy: str) -> DeviceFault:
    """A fault for an angle that is off."""
    value, limit = round(math.degrees(found.value), 2), round(math.degrees(found.limit), 2)
    told = f"{what} {value:g} deg, more than the {limit:g} deg that can be true"
    return DeviceFault(told, node=node, value=value, limit=limit, remedy=remedy)
