"""A daemon's life under a service manager: reloads good and bad, and its end."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path

import msgspec
import pytest

from canhelm.errors import BusOff, CanhelmError, ConfigError, Refused
from daemon.app import App
from daemon.life import Life
from daemon.runtime.notify import ServiceManager
from drivers.contract import NodeState
from profiles.kept import kept
from profiles.loader import load
from profiles.schema import Profile
from vcan_tests.manager import Manager
from vcan_tests.robot import Robot


class Daemon:
    """A daemon under test.

    Attributes:
        life: what runs it.
        manager: what the service manager hears.
        found: the profile that a reload finds, or why there is none.
        folder: where the profile is kept.
    """

    def __init__(self, path: Path) -> None:
        self.manager = Manager(path)
        self.found: Profile | CanhelmError = load("max2d").profile
        self.folder = path.parent
        self.life = Life(self._make_app, self._load, ServiceManager(str(path), 2.0), self.folder)

    def _make_app(self, profile: Profile) -> App:
        if profile.name == "unfit":
            raise ConfigError("the profile does not fit the bus", remedy="give another bus")
        return App(profile)

    async def _load(self) -> Profile:
        await asyncio.sleep(0.1)
        if isinstance(self.found, CanhelmError):
            raise self.found
        return self.found

    @property
    def robot(self) -> Robot:
        """The robot that runs now."""
        return Robot(self.life.app)

    def told(self) -> str:
        """Everything that was told since the last call, without the watchdog's food."""
        return "\n".join("\n".join(lines) for lines in self.manager.heard() if lines != ["WATCHDOG=1"])


@pytest.fixture
def daemon(tmp_path: Path) -> Iterator[Daemon]:
    daemon = Daemon(tmp_path / "notify")
    yield daemon
    daemon.manager.close()


@asynccontextmanager
async def running(daemon: Daemon) -> AsyncIterator[asyncio.Task[str]]:
    """The daemon from idle to its orderly end."""
    life = asyncio.create_task(daemon.life.run(load("max2d").profile))
    await asyncio.sleep(0)
    await daemon.robot.until(lambda: daemon.robot.state == "idle")
    yield life
    if not life.done():
        daemon.life.end()
        assert await life == "the vehicle is at rest and its drives are off"


def renamed(name: str) -> Profile:
    return msgspec.structs.replace(load("max2d").profile, name=name)


async def test_ready_means_that_it_can_be_asked_and_comes_before_any_node(daemon: Daemon) -> None:
    async with running(daemon):
        first = daemon.manager.heard()[0]
        assert first[0] == "READY=1"
        assert first[1].startswith("STATUS=waiting")


async def test_a_good_profile_is_taken_over_by_a_daemon_that_begins_anew(daemon: Daemon) -> None:
    async with running(daemon):
        before = daemon.life.app
        daemon.told()
        daemon.found = renamed("other")
        await daemon.life.reload()
        await asyncio.sleep(1.0)
        assert daemon.life.app is not before
        assert daemon.life.app.profile.name == "other"
        await daemon.robot.until(lambda: daemon.robot.state == "idle")
        told = daemon.told()
        assert told.index("RELOADING=1") < told.index("READY=1") < told.index("STATUS=idle")


async def test_a_profile_with_mistakes_is_refused_and_the_daemon_goes_on(
    daemon: Daemon, caplog: pytest.LogCaptureFixture
) -> None:
    async with running(daemon):
        before = daemon.life.app
        daemon.told()
        daemon.found = ConfigError("profile lab1 has 1 mistake:\n  lab1.yaml:6: drives.rear_right.node: is 200")
        await daemon.life.reload()
        reason = "reload refused: profile lab1 has 1 mistake: lab1.yaml:6: drives.rear_right.node: is 200"
        assert daemon.told().endswith(f"READY=1\nSTATUS=idle - {reason}")
        assert daemon.life.app is before
        assert "lab1.yaml:6" in caplog.text


async def test_the_profile_with_which_a_daemon_runs_is_kept_for_a_clean_up(daemon: Daemon) -> None:
    async with running(daemon):
        assert kept(daemon.folder) == daemon.life.app.profile
        daemon.found = renamed("other")
        await daemon.life.reload()
        await asyncio.sleep(1.0)
        assert kept(daemon.folder) == daemon.life.app.profile
        assert daemon.life.app.profile.name == "other"


async def test_a_profile_that_can_not_be_kept_keeps_no_daemon_from_running(
    daemon: Daemon, caplog: pytest.LogCaptureFixture
) -> None:
    (daemon.folder / "profile.json.new").mkdir()
    async with running(daemon):
        assert kept(daemon.folder) is None
    assert "the profile can't be kept" in caplog.text


async def test_a_profile_that_does_not_fit_the_bus_is_refused(daemon: Daemon) -> None:
    async with running(daemon):
        daemon.found = renamed("unfit")
        await daemon.life.reload()
        assert daemon.told().endswith("reload refused: the profile does not fit the bus (give another bus)")


async def test_the_remark_on_a_refused_reload_goes_with_the_next_good_one(daemon: Daemon) -> None:
    async with running(daemon):
        daemon.found = Refused("no")
        await daemon.life.reload()
        daemon.found = renamed("other")
        await daemon.life.reload()
        await asyncio.sleep(1.0)
        await daemon.robot.until(lambda: daemon.robot.state == "idle")
        assert daemon.told().endswith("STATUS=idle")


async def test_nothing_is_reloaded_while_the_robot_drives_and_it_drives_on(daemon: Daemon) -> None:
    async with running(daemon):
        robot = daemon.robot
        driving = asyncio.create_task(robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.4, duration_s=5.0))
        await robot.until(lambda: robot.speed_m_s > 0.35)
        await daemon.life.reload()
        assert "reload refused: the vehicle's state is active" in daemon.told()
        assert robot.speed_m_s > 0.35
        await driving
        await robot.hang_up()


async def test_a_motion_that_begins_while_the_profile_is_read_comes_first(daemon: Daemon) -> None:
    async with running(daemon):
        robot = daemon.robot
        reloading = asyncio.create_task(daemon.life.reload())
        await asyncio.sleep(0.05)
        driving = asyncio.create_task(robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.4, duration_s=1.0))
        await reloading
        assert daemon.life.app is robot.app
        assert (await driving)["duration_s"] > 1.0
        await robot.hang_up()


async def test_a_latched_stop_is_not_lost_by_a_reload(daemon: Daemon) -> None:
    async with running(daemon):
        await daemon.robot.call("estop")
        await asyncio.sleep(1.0)
        await daemon.life.reload()
        assert "reload refused: the vehicle's state is estop" in daemon.told()
        assert daemon.robot.state == "estop"


async def test_a_second_hang_up_while_one_is_worked_on_means_the_same_reload(daemon: Daemon) -> None:
    async with running(daemon):
        daemon.told()
        daemon.life.hang_up()
        daemon.life.hang_up()
        await asyncio.sleep(2.0)
        assert daemon.told().count("RELOADING=1") == 1


async def test_an_end_in_the_middle_of_a_reload_is_an_end(daemon: Daemon) -> None:
    async with running(daemon) as life:
        daemon.life.hang_up()
        await asyncio.sleep(0.05)
        daemon.life.end()
        assert await life == "the vehicle is at rest and its drives are off"


async def test_the_end_is_announced_before_the_robot_slows_down(daemon: Daemon) -> None:
    async with running(daemon) as life:
        robot = daemon.robot
        driving = asyncio.create_task(robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.4, duration_s=5.0))
        await robot.until(lambda: robot.speed_m_s > 0.35)
        daemon.life.end()
        assert robot.speed_m_s > 0.35
        assert daemon.told().endswith("STOPPING=1\nSTATUS=stopping: bringing the vehicle to rest")
        await life
        assert robot.fastest_wheel_m_s < 0.01
        with pytest.raises(Refused):
            await driving
        await robot.hang_up()


async def test_without_a_service_manager_a_hang_up_is_the_end() -> None:
    async def load_anew() -> Profile:
        raise AssertionError

    life = Life(App, load_anew, ServiceManager())
    running = asyncio.create_task(life.run(load("max2d").profile))
    await asyncio.sleep(3.0)
    life.hang_up()
    assert await running == "the vehicle is at rest and its drives are off"


async def test_a_bus_that_is_missing_is_waited_for_and_told_of(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    app = App(load("max2d").profile)
    open_bus = app.bus.open
    fed: list[float] = []

    async def refuse() -> None:
        raise BusOff("can0 is missing", remedy="plug the adapter in")

    monkeypatch.setattr(app.bus, "open", refuse)
    app.cycle.on_good = fed.append
    await app.start()
    await asyncio.sleep(5.0)
    assert len(fed) > 490
    assert app.service.status()["message"] == "can0 is missing (plug the adapter in)"
    assert app.service.sentence == "waiting: can0 is missing (plug the adapter in)"
    assert len(caplog.records) == 1
    monkeypatch.setattr(app.bus, "open", open_bus)
    await Robot(app).until(lambda: app.service.state == "idle")
    assert await app.close() == ()


async def test_a_daemon_whose_bus_never_came_ends_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    app = App(load("max2d").profile)

    async def refuse() -> None:
        raise BusOff("can0 is missing")

    monkeypatch.setattr(app.bus, "open", refuse)
    await app.start()
    await asyncio.sleep(5.0)
    assert len(await app.close()) == 4


async def test_the_last_words_of_a_daemon_without_a_bus_say_that_none_was_opened() -> None:
    async def load_anew() -> Profile:
        raise AssertionError

    missing = "rs232:/dev/ttyUSB99"
    life = Life(partial(App, bus=missing), load_anew, ServiceManager())
    running = asyncio.create_task(life.run(load("max2d").profile))
    await asyncio.sleep(3.0)
    life.end()
    assert await running == f"ended before {missing} could be opened: no drive was commanded"


@pytest.mark.parametrize(
    ("state", "told"), [(NodeState.ABSENT, "does not answer"), (NodeState.REFUSED, "is not ready")]
)
async def test_the_last_words_name_a_drive_that_nothing_is_known_of(
    daemon: Daemon, state: NodeState, told: str
) -> None:
    async with running(daemon) as life:
        if state is NodeState.REFUSED:
            await daemon.robot.call("simulation.fault", kind="wrong_identity", part="front_left")
        await daemon.robot.call("simulation.power", node="front_left", on=False)
        await daemon.robot.call("simulation.power", node="front_left", on=state is NodeState.REFUSED)
        await daemon.robot.until(lambda: daemon.robot.app.devices.by_node[3].node_state is state)
        await daemon.robot.hang_up()
        daemon.life.end()
        assert (await life).startswith(f"ended, but node 3 (front_left) {told}: make sure yourself")


async def test_the_last_words_tell_a_wheel_that_still_turns_from_a_drive_that_does_not_answer(daemon: Daemon) -> None:
    async with running(daemon) as life:
        drive = daemon.robot.app.devices.drives["front_left"]
        daemon.robot.app.supervisor.observers.append(lambda: setattr(drive, "speed_m_s", -0.3))
        await daemon.robot.until(lambda: drive.speed_m_s == -0.3)
        daemon.life.end()
        assert (await life).startswith("ended, but the wheel of node 3 (front_left) still turns at -0.30 m/s: make")
