"""What a profile says of a vehicle whose kind is a Python class of one's own."""

from __future__ import annotations

from typing import Annotated, ClassVar

from msgspec import Meta, field

from profiles.parts import Name, Part

CLASS_PATTERN = r"^[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*$"
ClassName = Annotated[str, Meta(pattern=CLASS_PATTERN)]
"""As package.module:Class."""


class OwnGeometry(Part, frozen=True, kw_only=True, tag_field="type", tag="own"):
    """A vehicle of a kind of one's own (docs/own-vehicle.md). Its classes run inside the daemon, with its rights."""

    type: ClassVar[str] = "own"
    kind: ClassName
    """Its law, as package.module:Class."""
    twin: ClassName | None = None
    """Its body in the simulation, likewise; None: its wheels turn in the air."""
    wheels: Annotated[tuple[str, ...], Meta(min_length=1)]
    """Names of the drives, in the order of the law."""
    encoders: tuple[str, ...] = ()
    """Names of the steering encoders, likewise."""
    brakes: tuple[str, ...] = ()
    """Names of the steering brakes, likewise."""
    parameters: dict[Name, float] = field(default_factory=dict)
    """Numbers that the law needs."""
