"""The method of the socket API that tells a map what a vehicle looks like."""

from __future__ import annotations

from typing import Final

from daemon.api.parameters import Method, Role

LOOK_METHODS: Final = (
    Method(
        "vehicle.shape",
        "What the vehicle looks like from above and what it may do; it does not change while the daemon runs.",
        (),
        "type, parts (name, outline_m), wheels, steering (drive of a steered axle, or null), limits, stream "
        "(parameters of drive.set that make sense), path (smallest radii, lead_m), reflectors, simulated",
        Role.WATCH,
    ),
)
