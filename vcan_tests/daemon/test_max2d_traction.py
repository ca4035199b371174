"""The MAX2D on ice by place, over the simulated bus, with and without its traction loop."""

from __future__ import annotations

import asyncio
import functools
from dataclasses import dataclass

import msgspec
import pytest

from daemon.runtime.clock import run_virtual
from drivers.simulated.max2d import Max2dWorld
from profiles.loader import load
from profiles.schema import FloorPatch, PairedSteerGeometry, Profile, TractionConfig
from vcan_tests.robot import running_robot

ICE = 0.03
WHERE = {"all_over": (-1.0, 3.0), "at_the_end": (0.9, 2.0)}
"""From where to where the ice reaches across the way."""


@dataclass
class Drive:
    """What a drive of 1.2 m straight ahead came to."""

    worst_slip_m_s: float = 0.0
    held_cycles: int = 0
    end_m: float = 0.0


def robot(traction: bool, ice: str | None) -> Profile:
    """The MAX2D with drives whose currents tell slip."""
    profile = load("max2d").profile
    simulation, vehicle = profile.simulation, profile.vehicle
    assert simulation is not None
    assert isinstance(vehicle, PairedSteerGeometry)
    rolling_n = simulation.tyre.rolling_resistance * vehicle.mass_kg * 9.81 / 4
    config = TractionConfig(
        response_s=0.025, wheel_inertia_kg_m2=simulation.wheel_inertia_kg_m2, rolling_resistance_n=rolling_n
    )
    floor = {}
    if ice is not None:
        begin, end = WHERE[ice]
        floor["ice"] = FloorPatch(x_m=(begin + end) / 2, y_m=0, length_m=end - begin, width_m=9, friction=ICE)
    drives = {name: msgspec.structs.replace(drive, mode="velocity") for name, drive in profile.drives.items()}
    return msgspec.structs.replace(
        profile,
        drives=drives,
        traction=config if traction else None,
        simulation=msgspec.structs.replace(simulation, floor=floor),
    )


@functools.cache
def driven(traction: bool, ice: str | None = None, method: str = "drive.parallel") -> Drive:
    return run_virtual(_drive(robot(traction, ice), method))


async def _drive(profile: Profile, method: str) -> Drive:
    drive = Drive()
    async with running_robot(profile) as running:
        world = running.network.world
        assert isinstance(world, Max2dWorld)

        def look() -> None:
            for motion in running.app.service.status()["motions"]:
                drive.held_cycles += "traction" in motion.get("limits_active", ())
            drive.worst_slip_m_s = max(drive.worst_slip_m_s, *map(abs, world.slip_m_s))

        running.app.supervisor.observers.append(look)
        how = {"angle_deg": 0.0} if method == "drive.parallel" else {"rear_deg": 8.0, "front_deg": -16.0}
        await running.call(method, **how, speed_m_s=0.4, duration_s=3.0)
        world.advance(asyncio.get_running_loop().time())
        drive.end_m = world.pose[0]
    return drive


@pytest.mark.parametrize("ice", WHERE)
def test_on_ice_no_wheel_spins_or_locks_as_without_the_loop(ice: str) -> None:
    without, held = driven(False, ice), driven(True, ice)
    assert without.worst_slip_m_s > 0.2
    assert held.worst_slip_m_s < 0.4 * without.worst_slip_m_s


@pytest.mark.parametrize("method", ["drive.parallel", "drive.turn"])
def test_on_dry_floor_nothing_is_held_and_the_robot_ends_where_it_did(method: str) -> None:
    without, held = driven(False, None, method), driven(True, None, method)
    assert held.held_cycles == 0
    assert held.end_m == pytest.approx(without.end_m, abs=1e-3)


def test_a_held_robot_says_which_limit_holds_it() -> None:
    assert driven(True, "all_over").held_cycles > 50
