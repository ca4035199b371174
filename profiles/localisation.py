"""What a profile says of localisation: reflectors, the scanner, what it can be trusted; and of a simulated scanner."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from profiles.parts import Name, NotNegative, Part, Positive


class ReflectorConfig(Part, frozen=True, kw_only=True):
    """A mark whose place is known."""

    x_m: float
    y_m: float


class ScannerConfig(Part, frozen=True, kw_only=True):
    """Where the scanner is mounted."""

    on: Literal["vehicle", "trailer"] = "vehicle"
    """Its frame: that of the vehicle's pose, or that of the last axle of its trailer."""
    x_m: float = 0.0
    y_m: float = 0.0
    rotation_deg: float = 0.0
    """Of its direction 0, counter-clockwise."""


class LocalisationConfig(Part, frozen=True, kw_only=True):
    """The vehicle's pose from bearings to reflectors, filtered with its odometry."""

    reflectors: Annotated[dict[Name, ReflectorConfig], Meta(min_length=3)]
    """In the frame that the vehicle's pose shall be in."""
    scanner: ScannerConfig = ScannerConfig()
    bearing_noise_deg: Positive
    """Standard deviation of one bearing."""
    way_noise_m: Positive = 0.02
    """Standard deviation of the odometry's place after a metre; it grows with the root of the way."""
    turn_noise_deg: Positive = 1.0
    """Likewise of its heading."""


class SimulatedScannerConfig(Part, frozen=True, kw_only=True):
    """The scanner of the simulation, which sees the reflectors of `localisation`."""

    rate_hz: Annotated[float, Meta(gt=0, le=200)] = 10.0
    """Scans a second."""
    noise_deg: NotNegative = 0.0
    """Standard deviation of one bearing."""
    delay_ms: Annotated[float, Meta(ge=0, le=900)] = 0.0
    """Age of a scan when it arrives."""
    hidden_share: Annotated[float, Meta(ge=0, lt=1)] = 0.0
    """Part of the time for which something stands before a reflector."""
    hidden_s: Positive = 1.0
    """How long it stands there, on average."""
    range_m: Positive = 100.0
    """Reflectors further away are not seen."""
    named: bool = True
    """Whether the scanner tells which reflector it has seen."""
