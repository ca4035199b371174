"""What a profile says of vehicles with a steered axle: the axle, the car, the semi-trailer."""

from __future__ import annotations

from typing import Annotated, ClassVar

from msgspec import Meta

from profiles.parts import Length, NotNegative, Offset, Part, Positive


class SteeredAxle(Part, frozen=True, kw_only=True):
    """An axle whose wheels a motor of its own steers, also while they roll."""

    drive: str
    """Name of the drive that turns it. Its wheel radius is the arm at which its speeds and ramps count."""
    encoder: str
    """Name of the encoder that tells its angle."""
    limit_deg: Annotated[float, Meta(gt=0, lt=90)]
    """Steering angle that commands may ask for, to each side."""
    stop_deg: Annotated[float, Meta(gt=0, lt=90)]
    """Steering stops."""
    rate_deg_s: Positive
    acceleration_deg_s2: Positive


class RegulatorGains(Part, frozen=True, kw_only=True):
    """Gains of a PID regulator: of the error, its integral and its derivative."""

    proportional: NotNegative
    integral: NotNegative = 0.0
    derivative: NotNegative = 0.0


class CarGeometry(Part, frozen=True, kw_only=True, tag_field="type", tag="ackermann"):
    """Geometry and body of a car with front-wheel steering and two driven rear wheels (ENPM808X report, section 4)."""

    type: ClassVar[str] = "ackermann"
    mass_kg: Positive
    yaw_inertia_kg_m2: Positive
    centre_of_mass_height_m: NotNegative = 0.0
    wheelbase_m: Length
    """L: distance between the axles."""
    track_m: Length
    """W: distance between the wheels of an axle."""
    mass_offset_m: NotNegative
    """a: of the centre of mass forward of the rear axle."""
    wheels: tuple[str, str]
    """Names of the drives of the rear wheels: left, right."""
    steering: SteeredAxle
    """The front axle; its angle is that of a wheel between the two front ones (gamma)."""
    heading_regulator: RegulatorGains
    """Steering angle [rad] for an error of heading [rad]."""
    speed_regulator: RegulatorGains
    """Acceleration of the wheels [rad/s^2] for an error of speed [m/s]."""


class TrailerGeometry(Part, frozen=True, kw_only=True):
    """A semi-trailer with one axle."""

    mass_kg: Positive
    yaw_inertia_kg_m2: Positive
    """About its centre of mass."""
    length_m: Length
    """L2: from the hitch back to the axle."""
    mass_offset_m: NotNegative
    """Of the centre of mass behind the hitch."""
    encoder: str
    """Name of the encoder of the bending angle: the trailer's heading minus the truck's."""
    max_bending_deg: Annotated[float, Meta(gt=0, lt=180)]
    """Bending angle to both sides at which truck and trailer touch."""


class SemitrailerGeometry(Part, frozen=True, kw_only=True, tag_field="type", tag="semitrailer"):
    """A truck with a steered front axle and one driven axle, and its semi-trailer (thesis, chapter 2)."""

    type: ClassVar[str] = "semitrailer"
    mass_kg: Positive
    """Of the truck."""
    yaw_inertia_kg_m2: Positive
    """Of the truck, about its centre of mass."""
    wheelbase_m: Length
    """L1: from the steered to the driven axle."""
    mass_offset_m: NotNegative
    """Of the truck's centre of mass forward of the driven axle."""
    hitch_offset_m: Offset
    """M1: of the hitch behind the driven axle; negative: ahead of it."""
    wheels: tuple[str]
    """Name of the drive of the driven axle."""
    steering: SteeredAxle
    """The front axle."""
    trailer: TrailerGeometry

    @property
    def hitch_kg(self) -> float:
        """Mass that the trailer rests on the hitch."""
        return self.trailer.mass_kg * (1.0 - self.trailer.mass_offset_m / self.trailer.length_m)

    @property
    def driven_axle_kg(self) -> float:
        """Mass that stands on the driven axle."""
        own = self.mass_kg * (1.0 - self.mass_offset_m / self.wheelbase_m)
        return own + self.hitch_kg * (1.0 + self.hitch_offset_m / self.wheelbase_m)
