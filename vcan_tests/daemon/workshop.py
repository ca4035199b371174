"""A robot on blocks whose setup is played through: what it is built like, its daemon, the person beside it."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from daemon.app import App
from daemon.commissioning.session import commission
from daemon.commissioning.wheels import Findings
from profiles.loader import load
from profiles.schema import Profile
from vcan_tests.daemon.workshop_person import WorkshopPerson
from vcan_tests.robot import Robot

MAX2D = load("max2d").profile
ROBOT = "schema_version: 1\nname: lab1\nextends: robots/max2d\nsetup: needed\n"


def robot_file(folder: Path, text: str = "") -> Path:
    """A profile that extends the MAX2D."""
    folder.mkdir(exist_ok=True)
    file = folder / "lab1.yaml"
    file.write_text(ROBOT + text)
    return file


class Workshop:
    """A robot on blocks, its daemon, and the person beside it."""

    def __init__(self, app: App) -> None:
        self.robot = Robot(app)
        self.profile: Profile = app.profile
        self.person = WorkshopPerson(self.call)

    async def call(self, method: str, /, **params: Any) -> dict[str, Any]:
        """One method of the API, as a client calls it."""
        if method == "status":
            return self.robot.app.service.status()
        return await self.robot.call(method, **params)

    async def commission(self, what: str = "all") -> Findings:
        """All of ``canhelm setup`` but the last question."""
        return await commission(self, self.person, self.profile, what, 500)


@asynccontextmanager
async def workshop(profile: Path, built: Path | None = None, *, lifted: bool = True) -> AsyncIterator[Workshop]:
    """A running daemon with a profile on a robot that may be built otherwise."""
    app = App(load(profile).profile, built=load(built).profile if built else None, seed=1)
    await app.start()
    shop = Workshop(app)
    try:
        await shop.robot.until(lambda: shop.robot.state == "idle")
        await shop.call("simulation.lift", lifted=lifted)
        yield shop
    finally:
        await shop.robot.hang_up()
        await app.close()


def robot_of(folder: Path, robot: str, text: str) -> Path:
    """A profile that extends a shipped one."""
    folder.mkdir()
    file = folder / "lab1.yaml"
    file.write_text(f"schema_version: 1\nname: lab1\nextends: robots/{robot}\nsetup: needed\n{text}\n")
    return file
