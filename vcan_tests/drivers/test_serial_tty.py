from __future__ import annotations

import asyncio
import os
import termios
import tty
from collections.abc import AsyncIterator, Callable

import pytest

from canhelm.errors import BusOff, UsageError
from drivers.epos.serial_conversation import SerialTiming
from drivers.epos.serial_frames import make_read_object, make_write_object
from drivers.epos.serial_line import SerialLine
from drivers.epos.serial_tty import BAUD_RATES, SerialTty, require_serial_device
from vcan_tests.drivers.serial_bench import Drive

STATUSWORD = make_read_object(1, 0x6041, 0)
CONTROLWORD = make_write_object(1, 0x6040, 0, b"\x06\x00")


PATIENT = SerialTiming(acknowledge_s=3.0, answer_s=3.0, byte_s=3.0)
"""Outlives the pauses of a loaded machine."""


class Pty:
    """A pseudo terminal with the drive at its near end; the host opens ``device``."""

    def __init__(self) -> None:
        self._near, self._far = os.openpty()
        tty.setraw(self._far)
        self.device = os.ttyname(self._far)
        self.pulled = False
        self.drive: Drive | None = None

    def join(self, drive: Drive) -> Drive:
        """Put a drive behind the terminal."""
        self.drive = drive
        drive.host = lambda data, _: None if self.pulled else self.say(data)
        asyncio.get_running_loop().add_reader(self._near, lambda: drive.write(os.read(self._near, 4096)))
        return drive

    def say(self, data: bytes) -> None:
        os.write(self._near, data)

    def hear(self) -> bytes:
        return os.read(self._near, 4096)

    def settings(self) -> list[object]:
        return termios.tcgetattr(self._far)

    def pull(self) -> None:
        """The cable is pulled out: the terminal hangs up, and its path vanishes."""
        if not self.pulled:
            self.pulled = True
            if self.drive is not None:
                asyncio.get_running_loop().remove_reader(self._near)
            os.close(self._near)
            os.close(self._far)


@pytest.fixture
async def pty() -> AsyncIterator[Pty]:
    terminal = Pty()
    yield terminal
    terminal.pull()


@pytest.fixture
async def opened(pty: Pty) -> AsyncIterator[Callable[[], SerialTty]]:
    found: list[SerialTty] = []

    def open_it() -> SerialTty:
        serial = SerialTty(pty.device, 115200)
        serial.open()
        found.append(serial)
        return serial

    yield open_it
    for serial in found:
        serial.close()


# The line


@pytest.mark.real_time
async def test_reads_and_writes_go_through_a_terminal(pty: Pty, opened: Callable[[], SerialTty]) -> None:
    drive = pty.join(Drive())
    line = SerialLine(opened(), 115200, timing=PATIENT)
    for _ in range(50):
        await line.request(CONTROLWORD)
        assert (await line.request(STATUSWORD)).data == drive.value(1, 0x6041, 0)
    assert line.retries == 0


@pytest.mark.real_time
async def test_a_pulled_cable_fails_what_waits(pty: Pty, opened: Callable[[], SerialTty]) -> None:
    pty.join(Drive()).answering_s = 10.0
    serial = opened()
    line = SerialLine(serial, 115200)
    serial.on_lost = line.lose
    waiting = asyncio.ensure_future(line.request(STATUSWORD))
    await asyncio.sleep(0.01)
    pty.pull()
    with pytest.raises(BusOff):
        await waiting


@pytest.mark.real_time
async def test_a_cable_is_plugged_in_again(pty: Pty, opened: Callable[[], SerialTty]) -> None:
    serial = opened()
    line = SerialLine(serial, 115200)
    line.lose("Input/output error")
    serial.close()
    drive = pty.join(Drive())
    line.attach(opened())
    assert (await line.request(STATUSWORD)).data == drive.value(1, 0x6041, 0)


# The device


@pytest.mark.real_time
async def test_the_loss_is_told_once(pty: Pty, opened: Callable[[], SerialTty]) -> None:
    reasons: list[str] = []
    serial = opened()
    serial.on_lost = reasons.append
    pty.pull()
    serial.write(b"\x10")
    await asyncio.sleep(0.01)
    serial.write(b"\x10")
    await asyncio.sleep(0.01)
    assert len(reasons) == 1


@pytest.mark.real_time
async def test_the_device_is_raw_at_its_rate(pty: Pty, opened: Callable[[], SerialTty]) -> None:
    opened()
    settings = pty.settings()
    assert settings[4] == settings[5] == termios.B115200


@pytest.mark.real_time
async def test_all_bytes_pass_unchanged_both_ways(pty: Pty, opened: Callable[[], SerialTty]) -> None:
    heard, complete = bytearray(), asyncio.Event()

    def hear(data: bytes, _: float) -> None:
        heard.extend(data)
        if len(heard) >= 256:
            complete.set()

    serial = opened()
    serial.host = hear
    serial.write(bytes(range(256)))
    pty.say(bytes(range(256)))
    await asyncio.wait_for(complete.wait(), 5.0)
    assert pty.hear() == bytes(range(256)) == heard


@pytest.mark.real_time
async def test_what_the_device_has_no_room_for_is_sent_later(pty: Pty, opened: Callable[[], SerialTty]) -> None:
    sent = os.urandom(40_000)
    opened().write(sent)
    heard = bytearray()
    while len(heard) < len(sent):
        heard += pty.hear()
        await asyncio.sleep(0)
    assert heard == sent


@pytest.mark.real_time
async def test_old_bytes_are_thrown_away(pty: Pty, opened: Callable[[], SerialTty]) -> None:
    pty.say(b"old")
    heard = bytearray()
    opened().host = lambda data, _: heard.extend(data)
    pty.say(b"new")
    await asyncio.sleep(0.01)
    assert heard == b"new"


@pytest.mark.real_time
@pytest.mark.parametrize("device", ["/dev/no-such-tty", "/dev/null", "/"])
async def test_what_is_no_serial_device_is_told(device: str) -> None:
    with pytest.raises(BusOff, match="cannot open serial device"):
        SerialTty(device, 115200).open()


@pytest.mark.real_time
async def test_a_device_that_another_program_uses_is_refused(opened: Callable[[], SerialTty]) -> None:
    opened()
    with pytest.raises(BusOff, match="another program uses it"):
        opened()


@pytest.mark.real_time
async def test_an_adapter_is_told_to_hand_over_each_byte_at_once(
    pty: Pty, opened: Callable[[], SerialTty], monkeypatch: pytest.MonkeyPatch
) -> None:
    set_up: list[bytes] = []

    def ioctl(_: int, request: int, settings: bytearray) -> None:
        if request == 0x541F:  # TIOCSSERIAL
            set_up.append(bytes(settings[16:20]))

    monkeypatch.setattr("drivers.epos.serial_tty.fcntl.ioctl", ioctl)
    opened()
    assert set_up == [(1 << 13).to_bytes(4, "little")]


@pytest.mark.real_time
async def test_a_closed_device_swallows_what_is_written(opened: Callable[[], SerialTty]) -> None:
    serial = opened()
    serial.close()
    serial.write(b"\x10")
    serial.close()


def test_a_rate_that_no_drive_has_is_refused() -> None:
    with pytest.raises(UsageError, match="14400"):
        SerialTty("/dev/ttyS0", 14400)


def test_the_rates_are_those_of_the_drive() -> None:
    assert list(BAUD_RATES) == [9600, 19200, 38400, 57600, 115200]


@pytest.mark.parametrize(
    ("path", "told"), [("/tmp", "no serial device"), ("/dev/null", "no serial device"), ("pty", "canhelm simulate")]
)
def test_what_can_never_be_a_serial_line_is_told_at_once(path: str, told: str) -> None:
    with pytest.raises(UsageError, match=told):
        require_serial_device(path)


async def test_a_terminal_and_a_device_that_is_missing_may_be_waited_for(pty: Pty) -> None:
    for path in (pty.device, "/dev/ttyUSB99"):
        require_serial_device(path)
