"""What every part of a profile is made of."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

Name = Annotated[str, Meta(pattern="^[A-Za-z][A-Za-z0-9_-]*$", max_length=40)]
"""Begins with a letter: commands take a node id or a name."""
Positive = Annotated[float, Meta(gt=0)]
NotNegative = Annotated[float, Meta(ge=0)]
WheelRadius = Annotated[float, Meta(ge=0.001, le=1)]
"""[m] No drive of this size turns a larger wheel: who writes 100 means millimetres."""
Length = Annotated[float, Meta(gt=0, le=20)]
"""[m] Of a vehicle; more is millimetres, too."""
Offset = Annotated[float, Meta(ge=-5, le=5)]
"""[m] Of a wheel from its steering axis, or a hitch from its axle."""
ADDRESS_PATTERN = r"^0x[0-9A-Fa-f]{1,4}(/([0-9]{1,2}|1[0-9]{2}|2[0-4][0-9]|25[0-5]))?$"
"""An object of a node: its index, and where it has several its subindex."""


class Part(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Common base: unknown keys are errors, values do not change."""
