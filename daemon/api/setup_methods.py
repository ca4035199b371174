"""The methods of the socket API that a commissioning holds the robot by, as data (see :mod:`daemon.api.methods`)."""

from __future__ import annotations

from daemon.api.parameters import Method, Param, Role

SETUP_METHODS = (
    Method(
        "setup.begin",
        "Keep the robot for a setup: nobody else moves or changes it until setup.end, or until the lease is over.",
        (),
        "holder",
        Role.CONFIGURE,
        needs_lease=True,
    ),
    Method(
        "setup.lower",
        "Lower the current limits of a drive; they come back with setup.restore, setup.end or the end of the lease.",
        (
            Param("node", "node", "node id or name of a drive"),
            Param("current_ma", "integer", "highest current meanwhile", "mA", minimum=50, maximum=5000),
        ),
        "node, lowered",
        Role.CONFIGURE,
    ),
    Method("setup.restore", "Put the current limits back.", (), "trouble", Role.CONFIGURE),
    Method(
        "setup.end",
        "Put the current limits back and let the robot go.",
        (),
        "trouble",
        Role.CONFIGURE,
    ),
)
