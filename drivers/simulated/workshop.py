"""What a person does to a simulated robot and sees of it in the workshop: lift it, turn wheels, push pairs, look."""

from __future__ import annotations

import asyncio
from math import degrees, radians
from typing import Any

from drivers.simulated.body import HAND_RAD_S
from drivers.simulated.max2d import Max2dWorld
from drivers.simulated.network import SimulatedNetwork
from drivers.simulated.world import STEP_S
from profiles.schema import PairedSteerGeometry, Profile
from profiles.steered import CarGeometry, SemitrailerGeometry


class Workshop:
    """A person beside a simulated robot. Names are those of the robot as it is built, not as it is wired.

    Args:
        profile: the robot as it is built.
        network: its network.
    """

    def __init__(self, profile: Profile, network: SimulatedNetwork) -> None:
        self._profile = profile
        self._network = network

    @property
    def parts(self) -> tuple[str, ...]:
        """What there is to turn and to push: wheels by their drives, pairs by their encoders."""
        return (*self._network.world.axes, *self._pairs)

    @property
    def _pairs(self) -> dict[str, str]:
        """Brakes of the wheel pairs by the pairs' encoders."""
        vehicle = self._profile.vehicle
        if not isinstance(vehicle, PairedSteerGeometry):
            return {}
        return dict(zip(vehicle.encoders, vehicle.brakes, strict=True))

    @property
    def _headings(self) -> tuple[str, ...]:
        """Encoders of what can be seen to turn: wheel pairs, a steered axle, a trailer."""
        vehicle = self._profile.vehicle
        if isinstance(vehicle, SemitrailerGeometry):
            return vehicle.steering.encoder, vehicle.trailer.encoder
        return (vehicle.steering.encoder,) if isinstance(vehicle, CarGeometry) else tuple(self._pairs)

    def lift(self, lifted: bool) -> None:
        """Put the robot onto blocks, or down again."""
        self._now()
        self._network.world.lifted = lifted

    async def turn(self, name: str, angle_deg: float) -> float:
        """Turn by hand a wheel, which rolls forward for a positive angle and takes its time, or push a wheel pair.

        Returns:
            By how much it has given way [degrees]: nothing for a pair that is locked, or a wheel on the floor.
        """
        self._now()
        return self._push(name, angle_deg) if name in self._pairs else await self._turn_wheel(name, radians(angle_deg))

    async def _turn_wheel(self, name: str, angle_rad: float) -> float:
        world = self._network.world
        if not world.lifted:
            return 0.0
        before = world.wheel_rad(name)
        world.turn_by_hand(name, angle_rad)
        await asyncio.sleep(abs(angle_rad) / HAND_RAD_S + 2.0 * STEP_S)
        self._now()
        return degrees(world.wheel_rad(name) - before)

    def _push(self, name: str, angle_deg: float) -> float:
        world = self._network.world
        if self._network.brakes[self._pairs[name]].engaged:
            return 0.0
        assert isinstance(world, Max2dWorld)
        before = world.heading_rad(name)
        world.set_heading(name, before + radians(angle_deg))
        return degrees(world.heading_rad(name) - before)

    def look(self) -> dict[str, Any]:
        """What can be seen: where the robot stands, angles of wheels, headings of pairs and axles, brakes."""
        self._now()
        world = self._network.world
        x_m, y_m, yaw_rad = world.pose
        return {
            "stands": {"x_m": round(x_m, 3), "y_m": round(y_m, 3), "yaw_deg": round(degrees(yaw_rad), 2)},
            "lifted": world.lifted,
            "floor": {
                "slope_deg": round(degrees(world.slope_rad), 2),
                "direction_deg": round(degrees(world.downhill_rad), 2),
            },
            "wheel_deg": {name: round(degrees(world.wheel_rad(name)), 2) for name in world.axes},
            "heading_deg": {name: round(degrees(world.heading_rad(name)), 2) for name in self._headings},
            "brakes_engaged": {name: brake.engaged for name, brake in self._network.brakes.items()},
        }

    def _now(self) -> None:
        self._network.world.advance(asyncio.get_running_loop().time())
