"""What the service manager hears: readiness, status, the watchdog's food, reloads."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from daemon.runtime.activation import inherited_sockets
from daemon.runtime.cycle import Cycle
from daemon.runtime.notify import ServiceManager
from vcan_tests.manager import Manager
from vcan_tests.robot import running_robot


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[Manager]:
    manager = Manager(tmp_path / "notify")
    yield manager
    manager.close()


@pytest.fixture
def notifier(manager: Manager) -> Iterator[ServiceManager]:
    """The daemon's end of the manager's socket, of a vehicle that is idle, with a watchdog of 2 s."""
    notifier = ServiceManager(os.fspath(manager.path), 2.0)
    notifier.sentence = lambda: "idle"
    yield notifier
    notifier.close()


def test_readiness_comes_with_a_status(manager: Manager, notifier: ServiceManager) -> None:
    notifier.ready()
    assert manager.heard() == [["READY=1", "STATUS=idle"]]


def test_the_watchdog_is_fed_four_times_in_its_time_and_no_more(manager: Manager, notifier: ServiceManager) -> None:
    for cycle in range(400):
        notifier.good_cycle(cycle * 0.01)
    assert manager.fed() == 8


def test_the_status_is_told_when_it_has_changed(manager: Manager, notifier: ServiceManager) -> None:
    notifier.ready()
    notifier.good_cycle(1.0)
    notifier.sentence = lambda: "fault: node 3 (front_left) is lost"
    notifier.good_cycle(2.0)
    notifier.good_cycle(3.0)
    assert manager.heard()[1:] == [
        ["WATCHDOG=1"],
        ["WATCHDOG=1", "STATUS=fault: node 3 (front_left) is lost"],
        ["WATCHDOG=1"],
    ]


def test_a_status_that_a_busy_manager_did_not_hear_is_told_again(manager: Manager, notifier: ServiceManager) -> None:
    notifier.ready()
    fill(manager)
    notifier.sentence = lambda: "fault"
    notifier.good_cycle(1.0)
    manager.heard()
    notifier.good_cycle(2.0)
    assert manager.heard() == [["WATCHDOG=1", "STATUS=fault"]]


def fill(manager: Manager) -> None:
    """Leave the manager no room for another message."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender, contextlib.suppress(BlockingIOError):
        sender.setblocking(False)
        while True:
            sender.sendto(b"", os.fspath(manager.path))


def test_a_status_is_one_line_whatever_is_in_it(manager: Manager, notifier: ServiceManager) -> None:
    notifier.remark = "reload refused: profile lab1 has 1 mistake:\n  lab1.yaml:6: node: is 200\nWATCHDOG=1"
    notifier.ready()
    assert manager.heard() == [
        ["READY=1", "STATUS=idle - reload refused: profile lab1 has 1 mistake: lab1.yaml:6: node: is 200 WATCHDOG=1"]
    ]


async def test_a_reload_begins_with_the_time_of_the_monotonic_clock(manager: Manager, notifier: ServiceManager) -> None:
    notifier.reloading()
    (message,) = manager.heard()
    assert message[:2] == ["RELOADING=1", "MONOTONIC_USEC=0"]


def test_without_a_service_manager_nothing_is_sent() -> None:
    notifier = ServiceManager.of({}, 1)
    notifier.ready()
    assert not notifier.present


def test_an_abstract_address_is_understood() -> None:
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    name = f"canhelm-test-{os.getpid()}"
    listener.bind(f"\0{name}")
    notifier = ServiceManager.of({"NOTIFY_SOCKET": f"@{name}"}, 1)
    notifier.stopping("stopping")
    notifier.close()
    assert listener.recv(100) == b"STOPPING=1\nSTATUS=stopping"
    listener.close()


def test_a_watchdog_meant_for_another_process_is_not_fed_faster(manager: Manager) -> None:
    environment = {"NOTIFY_SOCKET": os.fspath(manager.path), "WATCHDOG_USEC": "100000", "WATCHDOG_PID": "7"}
    notifier = ServiceManager.of(environment, 8)
    for cycle in range(100):
        notifier.good_cycle(cycle * 0.01)
    notifier.close()
    assert manager.fed() == 2


def test_a_service_manager_that_has_gone_is_complained_about_once(
    manager: Manager, notifier: ServiceManager, caplog: pytest.LogCaptureFixture
) -> None:
    manager.path.unlink()
    notifier.good_cycle(1.0)
    notifier.good_cycle(2.0)
    assert len(caplog.messages) == 1


async def test_a_cycle_that_missed_its_deadline_feeds_nobody() -> None:
    async with running_robot(powered=False, booted=False) as robot:
        robot.app.cycle.stop()
        fed: list[float] = []
        cycle = Cycle(robot.app.master, robot.app.devices, 0.01, lambda now_s, dt_s: None, good_within=-1.0)
        cycle.on_good = fed.append
        cycle.start()
        await asyncio.sleep(0.2)
        cycle.stop()
        assert cycle.counters.late_cycles >= 19
        assert fed == []


@pytest.mark.parametrize("powered", [False, True])
async def test_good_cycles_feed_with_and_without_motor_power(powered: bool) -> None:
    async with running_robot(powered=powered, booted=False) as robot:
        fed: list[float] = []
        robot.app.cycle.on_good = fed.append
        await asyncio.sleep(2.0)
        assert len(fed) > 195


def test_sockets_meant_for_another_process_are_not_taken() -> None:
    assert inherited_sockets({"LISTEN_PID": "7", "LISTEN_FDS": "2"}, 8) == {}
