"""Wheel radius from a measured straight, track from a measured square, on a simulated robot that is built otherwise."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from canhelm.errors import Refused
from daemon.commissioning.scale import square, straight
from profiles.loader import load
from profiles.side_file import write_values
from vcan_tests.daemon.workshop import Workshop, robot_file, workshop

TURTLE = "schema_version: 1\nname: lab1\nextends: robots/turtle\n"
THIN = "\n".join(f"  wheel_{number}: {{wheel_radius_m: 0.048}}" for number in (1, 2, 3))
WIDE = "\n".join(f"    wheel_{number}: {{lever_m: 0.21}}" for number in (1, 2, 3))


class Driver:
    """Drives what is asked for, and measures it with a tape and a protractor."""

    def __init__(self, shop: Workshop, told: str | None = None) -> None:
        self._shop = shop
        self._told = told
        self._pose = (0.0, 0.0, 0.0)

    def tell(self, text: str) -> None:
        """Nothing to hear."""

    async def ask(self, question: str) -> str:
        """The answer."""
        world = self._shop.robot.network.world
        if question.startswith("mark"):
            self._pose = world.pose
        elif question.startswith("drive it straight"):
            await self._drive("drive.parallel", angle_deg=0.0, speed_m_s=0.4, duration_s=4.0)
        elif question.startswith("drive a square"):
            for _ in range(4):
                await self._drive("drive.parallel", angle_deg=0.0, speed_m_s=0.3, duration_s=0.5)
                await self._drive("drive.rotate", rate_deg_s=45.0, duration_s=2.0)
        elif self._told is not None:
            return self._told
        elif question.startswith("measured distance"):
            return str(math.dist(world.pose[:2], self._pose[:2]))
        else:
            return str(math.degrees(world.pose[2] - self._pose[2]))
        return ""

    async def _drive(self, method: str, **params: Any) -> None:
        await self._shop.call(method, **params)


def files(folder: Path, text: str) -> tuple[Path, Path]:
    """The robot's profile, and one of how it is built."""
    for name, more in (("mine", ""), ("built", text)):
        (folder / name).mkdir()
        (folder / name / "lab1.yaml").write_text(TURTLE + more)
    return folder / "mine" / "lab1.yaml", folder / "built" / "lab1.yaml"


async def test_a_straight_tells_the_radius_of_the_wheels(tmp_path: Path) -> None:
    mine, built = files(tmp_path, f"drives:\n{THIN}\n")
    async with workshop(mine, built, lifted=False) as shop:
        write_values(mine, await straight(shop, Driver(shop), shop.profile))
    radii = [drive.wheel_radius_m for drive in load(mine).profile.drives.values()]
    assert radii == pytest.approx([0.048] * 3, rel=0.01)


async def test_a_square_tells_the_levers_of_omni_wheels(tmp_path: Path) -> None:
    mine, built = files(tmp_path, f"vehicle:\n  wheels:\n{WIDE}\n")
    async with workshop(mine, built, lifted=False) as shop:
        values = await square(shop, Driver(shop), shop.profile)
    assert sorted(values) == [("vehicle", "wheels", f"wheel_{number}", "lever_m") for number in (1, 2, 3)]
    assert list(values.values()) == pytest.approx([0.21] * 3, rel=0.01)


async def test_a_scale_that_no_wear_explains_is_refused(tmp_path: Path) -> None:
    mine, _ = files(tmp_path, "")
    async with workshop(mine, lifted=False) as shop:
        with pytest.raises(Refused, match="no matter of calibration"):
            await straight(shop, Driver(shop, told="9"), shop.profile)


async def test_a_straight_too_short_to_measure_is_refused(tmp_path: Path) -> None:
    mine, _ = files(tmp_path, "")
    async with workshop(mine, lifted=False) as shop:
        with pytest.raises(Refused, match=r"it went 0\.000 m"):
            await straight(shop, shop.person, shop.profile)


async def test_the_square_of_a_robot_that_turns_by_its_headings_is_refused(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path), lifted=False) as shop:
        with pytest.raises(Refused, match="of type paired_steer turns does not follow from its track"):
            await square(shop, shop.person, shop.profile)
