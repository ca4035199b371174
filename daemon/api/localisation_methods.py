"""The methods ``localisation.*`` of the socket API."""

from __future__ import annotations

from typing import Final

from daemon.api.parameters import Method, Param

_BEARINGS = "objects with bearing_deg, counter-clockwise from the scanner's direction 0, and reflector if it is known"

LOCALISATION_METHODS: Final = (
    Method(
        "localisation.bearings",
        "Correct the vehicle's pose by bearings to its reflectors, from a scanner of one's own.",
        (
            Param("bearings", "list", _BEARINGS),
            Param("age_ms", "number", "time since the scan was taken", "ms", 0.0, 0.0, 1000.0),
        ),
        "used, rejected, state, x_m, y_m, heading_deg, position_std_m, heading_std_deg",
    ),
)
