"""The methods ``lease.*`` of the socket API, as data (see :mod:`daemon.api.methods`)."""

from __future__ import annotations

from typing import Final

from daemon.api.parameters import Method, Role

LEASE_METHODS: Final = (
    Method("lease.renew", "The client is alive: its motions go on.", (), "lease", Role.WATCH),
    Method(
        "lease.close", "Stop the motions of this connection; answers when they have ended.", (), "state", Role.WATCH
    ),
    Method(
        "lease.take",
        "Take the robot over: what others move comes to rest, and they move nothing as long as this lease is renewed; "
        "answers at rest.",
        (),
        "taken_from (who had it, or null)",
    ),
)
