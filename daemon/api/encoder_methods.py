"""The methods of the socket API about the zero of encoders, as data (see :mod:`daemon.api.methods`)."""

from __future__ import annotations

from daemon.api.parameters import Method, Param, Role

ENCODER_METHODS = (
    Method(
        "encoder.status",
        "What encoders say, and their zero.",
        (Param("pair", "string", "name of an encoder, or all", default="all"),),
        "encoders",
        Role.WATCH,
    ),
    Method(
        "encoder.zero",
        "The pair stands straight: preset its encoder, save and restart it; or tell what the profile has to say.",
        (
            Param("pair", "string", "name of the encoder"),
            Param("store", "string", "where the zero is kept", default="device", choices=("device", "profile")),
            Param("force", "boolean", "also where it stands far from its old zero", default=False),
        ),
        "pair, store, heading_before_deg, position_before_counts, zero_before_counts, offset_before_counts, "
        "zero_counts, note",
        Role.CONFIGURE,
    ),
)
