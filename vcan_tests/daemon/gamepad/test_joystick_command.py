"""``canhelm drive joystick`` as a person uses it: a daemon as a process, a socket, and a pad that comes and goes.

The event device is a pipe with a name, in folders as sysfs and udev make them: no kernel here has uinput.
"""

from __future__ import annotations

import json
import os
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from daemon.cli import joystick
from daemon.cli.main import main
from daemon.gamepad import pad, pads
from vcan_tests.daemon.gamepad.recorded_pad import button_events, stick_events, untouched
from vcan_tests.daemon.gamepad.test_pads import XBOX_ABS, XBOX_KEYS, Machine
from vcan_tests.daemon.test_processes import Bench, at_rest, speeds

NAME = "Microsoft X-Box 360 pad"


@pytest.fixture
def device(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The event device of a pad that is plugged in."""
    machine = Machine(tmp_path)
    monkeypatch.setattr(pads, "SYSFS", machine.sysfs)
    monkeypatch.setattr(pads, "DEVICES", machine.devices)
    monkeypatch.setattr(joystick, "RETRY_S", 0.2)
    monkeypatch.setattr(pad, "snapshot", lambda device, info: untouched())
    path = machine.plug(7, NAME, XBOX_ABS, XBOX_KEYS)
    path.unlink()
    os.mkfifo(path)
    return path


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    made = Bench(tmp_path)
    yield made
    made.kill()


class Person:
    """Somebody with a pad in a thread of their own; the command has the main one, for its signals.

    Attributes:
        over: set when the command has ended.
        wrong: what this person has seen that should not be.
    """

    def __init__(self, device: Path, acts: Callable[[Person], None]) -> None:
        self.wrong: list[BaseException] = []
        self.device = device
        self.wire = os.open(device, os.O_RDWR)
        self.over = threading.Event()
        self._thread = threading.Thread(target=self._act, args=(acts,))
        self._thread.start()

    def _act(self, acts: Callable[[Person], None]) -> None:
        try:
            acts(self)
        except BaseException as error:  # noqa: BLE001 - told in the main thread
            self.wrong.append(error)
        if not self.over.is_set():
            os.kill(os.getpid(), signal.SIGINT)

    def begin(self) -> None:
        """Let go of everything once, hold the button, and push the stick."""
        for events in (button_events("BTN_TL", down=False), button_events("BTN_TL", down=True)):
            os.write(self.wire, events)
            threading.Event().wait(0.3)
        os.write(self.wire, stick_events("ABS_Y", -0.7))

    def unplug(self) -> None:
        """The device has no other end any more."""
        os.close(self.wire)

    def plug_in(self) -> None:
        """It has one again, and the command has had the time to see it."""
        self.wire = os.open(self.device, os.O_RDWR)
        threading.Event().wait(4 * joystick.RETRY_S)

    def ends(self) -> None:
        """The command is over, and nothing was wrong."""
        self.over.set()
        self._thread.join()
        assert not self.wrong, self.wrong


def drive(bench: Bench, device: Path, acts: Callable[[Person], None]) -> int:
    """The command until somebody ends it, in the hands of a person who acts; its exit code."""
    person = Person(device, acts)
    try:
        return main(["drive", "joystick", "--socket", str(bench.socket)])
    finally:
        person.ends()


@pytest.mark.real_time
@pytest.mark.timeout(60)
def test_a_pad_drives_is_unplugged_comes_back_and_drives_again(
    bench: Bench, device: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def acts(person: Person) -> None:
        for _ in range(2):
            bench.wait_for(lambda status: not status["motions"])
            person.begin()
            bench.wait_for(lambda status: speeds(status)[0] > 0.3)
            person.unplug()
            bench.wait_for(at_rest)
            person.plug_in()

    assert drive(bench, device, acts) == 130
    told = capsys.readouterr().err
    assert told.count(f"{NAME} has gone (it says no more): the robot is at rest") == 2
    assert f"waiting for {NAME}" in told
    assert "hold BTN_TL to drive; let go of it and the robot is at rest within 2.8 s" in told


@pytest.mark.real_time
@pytest.mark.timeout(60)
def test_a_daemon_that_dies_on_the_way_ends_it(bench: Bench, device: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def acts(person: Person) -> None:
        person.begin()
        bench.wait_for(lambda status: speeds(status)[0] > 0.3)
        bench.process.kill()
        person.over.wait(30.0)

    assert drive(bench, device, acts) == 3
    told = capsys.readouterr().err.splitlines()
    assert told[-1].startswith("canhelm: the daemon hung up")
    assert all(line.startswith("canhelm: ") for line in told)


def test_without_the_pad_that_is_asked_for_it_ends_at_once(device: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["drive", "joystick", "--pad", "No Such Pad"]) == 4
    assert "no gamepad 'No Such Pad' is here" in capsys.readouterr().err


def test_the_list_is_one_object_a_line(device: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["drive", "joystick", "--list", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["name"], told["path"], told["readable"]) == (NAME, str(device), True)
    assert told["buttons"][:2] == ["BTN_SOUTH", "BTN_EAST"]


def test_without_a_pad_the_list_is_empty(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(pads, "SYSFS", tmp_path)
    assert main(["drive", "joystick", "--list", "--json"]) == 0
    out, err = capsys.readouterr()
    assert (out, err.startswith("canhelm: no gamepad is here; ")) == ("", True)


def test_a_machine_without_event_devices_is_told_to_be_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(pads, "SYSFS", tmp_path)
    monkeypatch.setattr(pads, "DEVICES", tmp_path / "input")
    assert main(["drive", "joystick", "--list", "--json"]) == 0
    assert f"there is no {tmp_path / 'input'}: the kernel has no event devices" in capsys.readouterr().err
