"""The daemon and its brick on a pseudo terminal, as over Bluetooth: in real time, with a cable that is pulled."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest

from canhelm.errors import CanhelmError
from daemon.app import App
from drivers.simulated.nxt_robot import SimulatedNxtRobot
from drivers.simulated.serial_wire import SerialPty
from profiles.loader import load

pytestmark = pytest.mark.real_time


class Cable:
    """A brick that is plugged into a device of one name, whatever terminal it gets."""

    def __init__(self, device: Path) -> None:
        self.robot = SimulatedNxtRobot()
        self._device = device
        self._pty: SerialPty | None = None

    def plug_in(self) -> None:
        self._pty = SerialPty(self.robot.brick.cable)
        self._device.symlink_to(self._pty.device)

    def pull(self) -> None:
        if self._pty is not None:
            self._device.unlink()
            self._pty.close()
            self._pty = None

    @property
    def turning(self) -> bool:
        self.robot.brick.catch_up()
        return any(abs(motor.speed_rad_s) > 0.05 for motor in self.robot.brick.motors)


async def until(app: App, condition: Callable[[], bool], timeout_s: float = 5.0) -> float:
    """Wait until a condition holds, looked at once a control cycle; the time it took."""
    loop, came = asyncio.get_running_loop(), asyncio.Event()
    begin_s = loop.time()

    def look() -> None:
        if condition():
            came.set()

    app.supervisor.observers.append(look)
    await asyncio.wait_for(came.wait(), timeout_s)
    app.supervisor.observers.remove(look)
    return loop.time() - begin_s


@pytest.fixture
async def cable(tmp_path: Path) -> AsyncIterator[Cable]:
    made = Cable(tmp_path / "rfcomm0")
    made.plug_in()
    yield made
    made.pull()


@pytest.fixture
async def app(cable: Cable, tmp_path: Path) -> AsyncIterator[App]:
    made = App(load("nxt").profile, f"serial:{tmp_path / 'rfcomm0'}")
    await made.start()
    await until(made, lambda: made.service.state == "idle")
    yield made
    await made.close()


async def test_a_line_is_driven_over_a_terminal(app: App, cable: Cable) -> None:
    await app.service.call("nxt.line", {"distance_m": 0.1, "power": 40}, None)
    cable.robot.brick.catch_up()
    assert 0.1 < cable.robot.x_m < 0.15


async def test_a_cable_pulled_in_a_move_is_told_within_a_second_and_nothing_starts_when_it_is_back(
    app: App, cable: Cable
) -> None:
    begun = await app.service.call("drive.to", {"x_m": 1.0, "y_m": 0.0, "wait": False}, None)
    await until(app, lambda: cable.turning)
    cable.pull()
    assert await until(app, lambda: app.service.state == "fault") < 1.0
    assert "is gone: the line was hung up" in app.supervisor.message
    with contextlib.suppress(CanhelmError):
        await app.service.call("motion.wait", begun, None)
    cable.plug_in()
    await until(app, lambda: not app.devices.bricks["nxt"].status_sentence.startswith("cannot"))
    await until(app, lambda: all(drive.node_state == "ready" for drive in app.devices.drives.values()))
    await asyncio.sleep(0.5)
    assert (app.service.state, cable.turning) == ("fault", False)
    await app.service.call("reset", {}, None)
    assert app.service.state == "idle"
