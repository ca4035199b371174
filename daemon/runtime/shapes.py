"""What a vehicle looks like from above, as its profile has it: outlines of its parts, and its wheels.

Each part has a frame of its own, x forward and y to the left: the body's origin is the point that odometry tells, the
trailer's is the middle of its axle. A profile knows where wheels are and how large, but neither what a body looks like
nor how wide a wheel is. So a body is a rectangle round its wheels, or a disc round omni-wheels; a wheel is WHEEL_WIDTH
of its radius wide; a truck, which is steered as if it had one wheel an axle, is TRUCK_TRACK of its wheelbase wide; and
a vehicle of one's own kind, of whose wheels only the radius is known, is a disc of OWN_SIZE of their radius.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from daemon.loops.geometry import contact_points
from daemon.loops.omni import OmniWheel
from profiles.bricks import DifferentialGeometry
from profiles.own_vehicle import OwnGeometry
from profiles.schema import OmniGeometry, PairedSteerGeometry, Profile
from profiles.steered import CarGeometry, SemitrailerGeometry

Point = tuple[float, float]

BODY: Final = "body"
TRAILER: Final = "trailer"
FRONT: Final = "front"
REAR: Final = "rear"
WHEEL_WIDTH: Final = 0.5
TRUCK_TRACK: Final = 0.7
OWN_SIZE: Final = 4.0
DISC_CORNERS: Final = 32


@dataclass(frozen=True, slots=True)
class Wheel:
    """One wheel from above.

    Attributes:
        name: of its drive, or where it has none of its own its axle and side.
        x_m, y_m: its middle at heading 0, in the frame of its part.
        radius_m: of the wheel.
        part: that it belongs to.
        steered, driven: whether it turns about a vertical axis, whether a motor rolls it.
        pivot_m: the vertical axis; None: through its middle.
    """

    name: str
    x_m: float
    y_m: float
    radius_m: float
    part: str = BODY
    steered: bool = False
    driven: bool = False
    pivot_m: Point | None = None

    @property
    def width_m(self) -> float:
        """Of the tread."""
        return WHEEL_WIDTH * self.radius_m

    def told(self) -> dict[str, Any]:
        """For ``vehicle.shape``."""
        pivot_x_m, pivot_y_m = self.pivot_m or (self.x_m, self.y_m)
        return {
            "name": self.name,
            "part": self.part,
            "x_m": round(self.x_m, 4),
            "y_m": round(self.y_m, 4),
            "pivot_x_m": round(pivot_x_m, 4),
            "pivot_y_m": round(pivot_y_m, 4),
            "radius_m": self.radius_m,
            "width_m": round(self.width_m, 4),
            "steered": self.steered,
            "driven": self.driven,
        }


@dataclass(frozen=True, slots=True)
class Shape:
    """Outlines by the names of the parts, and wheels."""

    outlines: dict[str, list[Point]]
    wheels: list[Wheel]

    def told(self) -> dict[str, Any]:
        """For ``vehicle.shape``."""
        parts = [
            {"name": name, "outline_m": [[round(x, 4), round(y, 4)] for x, y in outline]}
            for name, outline in self.outlines.items()
        ]
        return {"parts": parts, "wheels": [wheel.told() for wheel in self.wheels]}


def both_sides(axle: str) -> tuple[str, str]:
    """Names of the left and the right wheel of an axle that has no drive for each."""
    return f"{axle}_left", f"{axle}_right"


def shape_of(profile: Profile) -> Shape:
    """Outlines and wheels; nothing for drives without a vehicle."""
    geometry = profile.vehicle
    if isinstance(geometry, PairedSteerGeometry):
        return _paired(profile, geometry)
    if isinstance(geometry, OmniGeometry):
        return _omni(profile, geometry)
    if isinstance(geometry, DifferentialGeometry):
        return _differential(profile, geometry)
    if isinstance(geometry, CarGeometry):
        return _car(profile, geometry)
    if isinstance(geometry, SemitrailerGeometry):
        return _semitrailer(profile, geometry)
    if isinstance(geometry, OwnGeometry):
        return Shape({BODY: _disc(OWN_SIZE * max(_radius(profile, name) for name in geometry.wheels))}, [])
    return Shape({}, [])


def _paired(profile: Profile, geometry: PairedSteerGeometry) -> Shape:
    half_m, side_m = geometry.wheelbase_m / 2, geometry.pivot_track_m / 2
    pivots = ((-half_m, -side_m), (-half_m, side_m), (half_m, side_m), (half_m, -side_m))
    places = contact_points(geometry, 0.0, 0.0)
    wheels = [
        Wheel(name, *place, _radius(profile, name), steered=True, driven=True, pivot_m=pivot)
        for name, place, pivot in zip(geometry.wheels, places, pivots, strict=True)
    ]
    return Shape({BODY: _round(wheels)}, wheels)


def _omni(profile: Profile, geometry: OmniGeometry) -> Shape:
    """A wheel touches the floor at the foot of the perpendicular from the centre to the line that it rolls on."""
    wheels = []
    for name, config in geometry.wheels.items():
        wheel = OmniWheel(math.radians(config.direction_deg), config.lever_m)
        x_m, y_m = wheel.lever_m * math.sin(wheel.direction_rad), -wheel.lever_m * math.cos(wheel.direction_rad)
        wheels.append(Wheel(name, x_m, y_m, _radius(profile, name), driven=True))
    farthest_m = max(math.hypot(wheel.x_m, wheel.y_m) + wheel.width_m for wheel in wheels)
    return Shape({BODY: _disc(farthest_m)}, wheels)


def _differential(profile: Profile, geometry: DifferentialGeometry) -> Shape:
    """As long as it is wide: what carries it besides its two wheels is not in the profile."""
    right, left = geometry.wheels
    wheels = [
        Wheel(right, 0.0, -geometry.half_track_m, _radius(profile, right), driven=True),
        Wheel(left, 0.0, geometry.half_track_m, _radius(profile, left), driven=True),
    ]
    half_m = max(geometry.half_track_m, wheels[0].radius_m)
    return Shape({BODY: _rectangle(-half_m, half_m, geometry.half_track_m)}, wheels)


def _car(profile: Profile, geometry: CarGeometry) -> Shape:
    radius_m, side_m = _radius(profile, geometry.wheels[0]), geometry.track_m / 2
    left, right = geometry.wheels
    wheels = [
        Wheel(left, 0.0, side_m, radius_m, driven=True),
        Wheel(right, 0.0, -side_m, radius_m, driven=True),
        *_axle(FRONT, geometry.wheelbase_m, side_m, radius_m, steered=True),
    ]
    return Shape({BODY: _round(wheels)}, wheels)


def _semitrailer(profile: Profile, geometry: SemitrailerGeometry) -> Shape:
    radius_m, side_m = _radius(profile, geometry.wheels[0]), TRUCK_TRACK * geometry.wheelbase_m / 2
    truck = [
        *_axle(REAR, 0.0, side_m, radius_m, driven=True),
        *_axle(FRONT, geometry.wheelbase_m, side_m, radius_m, steered=True),
    ]
    trailer = _axle(TRAILER, 0.0, side_m, radius_m, part=TRAILER)
    hitch_m, width_m = geometry.trailer.length_m, side_m + trailer[0].width_m / 2
    outlines = {BODY: _round(truck), TRAILER: _rectangle(-radius_m, hitch_m + side_m, width_m)}
    return Shape(outlines, [*truck, *trailer])


def _axle(
    name: str,
    x_m: float,
    side_m: float,
    radius_m: float,
    *,
    part: str = BODY,
    steered: bool = False,
    driven: bool = False,
) -> list[Wheel]:
    left, right = both_sides(name)
    return [
        Wheel(left, x_m, side_m, radius_m, part, steered, driven),
        Wheel(right, x_m, -side_m, radius_m, part, steered, driven),
    ]


def _radius(profile: Profile, name: str) -> float:
    return profile.wheels[name].wheel_radius_m


def _round(wheels: Sequence[Wheel]) -> list[Point]:
    """The rectangle round wheels that roll ahead, symmetric about the x axis."""
    rear_m = min(wheel.x_m - wheel.radius_m for wheel in wheels)
    front_m = max(wheel.x_m + wheel.radius_m for wheel in wheels)
    return _rectangle(rear_m, front_m, max(abs(wheel.y_m) + wheel.width_m / 2 for wheel in wheels))


def _rectangle(rear_m: float, front_m: float, half_m: float) -> list[Point]:
    return [(front_m, half_m), (rear_m, half_m), (rear_m, -half_m), (front_m, -half_m)]


def _disc(radius_m: float) -> list[Point]:
    turns = [math.tau * corner / DISC_CORNERS for corner in range(DISC_CORNERS)]
    return [(radius_m * math.cos(turn), radius_m * math.sin(turn)) for turn in turns]
