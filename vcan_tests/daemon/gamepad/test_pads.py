"""Which pads there are, from a folder as sysfs has it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from canhelm.errors import NodeAbsent, PermissionRefused, UsageError
from daemon.gamepad import pads
from daemon.gamepad.pads import choose_pad, list_pads, require_parts, set_bits
from profiles.gamepad_codes import AXES, BUTTONS

XBOX_ABS = "3003f"
XBOX_KEYS = "7cdb000000000000 0 0 0 0"
KEYBOARD_KEYS = "1000000000007 ff9f207ac14057ff febeffdfffefffff fffffffffffffffe"


class Machine:
    """A machine's input devices."""

    def __init__(self, folder: Path) -> None:
        self.sysfs, self.devices = folder / "sys", folder / "dev"
        for path in (self.sysfs, self.devices):
            path.mkdir()

    def plug(self, number: int, name: str, axes: str, keys: str, bus: str = "0003", mode: int = 0o660) -> Path:
        """Plug in a device; its device file."""
        device = self.sysfs / f"event{number}" / "device"
        (device / "capabilities").mkdir(parents=True)
        (device / "id").mkdir()
        texts = {"name": name, "capabilities/abs": axes, "capabilities/key": keys, "id/bustype": bus}
        for place, text in texts.items():
            (device / place).write_text(f"{text}\n")
        path = self.devices / f"event{number}"
        path.touch(mode)
        return path


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Machine:
    made = Machine(tmp_path)
    monkeypatch.setattr(pads, "SYSFS", made.sysfs)
    monkeypatch.setattr(pads, "DEVICES", made.devices)
    made.plug(0, "AT Translated Set 2 keyboard", "0", KEYBOARD_KEYS)
    return made


@pytest.fixture
def closed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever runs the tests may read everything; here, nothing."""
    monkeypatch.setattr(os, "access", lambda path, mode: False)


def test_a_pad_is_told_with_its_axes_and_buttons(machine: Machine) -> None:
    path = machine.plug(12, "Microsoft X-Box 360 pad", XBOX_ABS, XBOX_KEYS)
    (pad,) = list_pads()
    assert (pad.name, pad.path, pad.connection) == ("Microsoft X-Box 360 pad", str(path), "usb")
    assert pad.axes == ("ABS_X", "ABS_Y", "ABS_Z", "ABS_RX", "ABS_RY", "ABS_RZ", "ABS_HAT0X", "ABS_HAT0Y")
    assert pad.buttons == (
        "BTN_SOUTH", "BTN_EAST", "BTN_NORTH", "BTN_WEST", "BTN_TL", "BTN_TR",
        "BTN_SELECT", "BTN_START", "BTN_MODE", "BTN_THUMBL", "BTN_THUMBR",
    )  # fmt: skip
    assert (pad.readable, pad.remedy) == (True, "")


def test_keyboards_and_machines_without_input_devices_have_none(
    machine: Machine, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert list_pads() == []
    monkeypatch.setattr(pads, "SYSFS", tmp_path / "nothing")
    assert list_pads() == []


def test_the_words_of_a_bitmap_are_as_long_as_the_machines_longs() -> None:
    assert set_bits("1 0", word_bits=64) == {64}
    assert set_bits("1 80000001", word_bits=32) == {0, 31, 32}


@pytest.mark.usefixtures("closed")
def test_a_pad_that_may_not_be_read_is_told_with_the_line_that_mends_it(machine: Machine) -> None:
    machine.plug(3, "Pad", XBOX_ABS, XBOX_KEYS)
    (pad,) = list_pads()
    assert not pad.readable
    assert "sudo usermod -aG" in pad.remedy
    with pytest.raises(PermissionRefused, match="may not read"):
        choose_pad(None)


def test_without_a_device_file_udev_is_named(machine: Machine) -> None:
    machine.plug(3, "Pad", XBOX_ABS, XBOX_KEYS).unlink()
    assert "udev" in list_pads()[0].remedy


def test_a_pad_is_chosen_by_name_by_path_or_as_the_first_one(machine: Machine, tmp_path: Path) -> None:
    machine.plug(10, "Second", XBOX_ABS, XBOX_KEYS, bus="0005")
    path = machine.plug(9, "First", XBOX_ABS, XBOX_KEYS)
    link = tmp_path / "by-id"
    link.symlink_to(path)
    assert [choose_pad(wanted).name for wanted in (None, "Second", str(link))] == ["First", "Second", "First"]
    assert choose_pad("Second").connection == "bluetooth"


def test_no_pad_is_an_error_that_says_where_to_look(machine: Machine) -> None:
    with pytest.raises(NodeAbsent, match="no gamepad 'Third' is here"):
        choose_pad("Third")


def test_what_a_pad_lacks_is_named(machine: Machine) -> None:
    machine.plug(3, "Old Stick", "3", "ff00000000 0 0 0 0")
    (pad,) = list_pads()
    with pytest.raises(UsageError, match="Old Stick has no ABS_RX, BTN_TL"):
        require_parts(pad, {"ABS_X", "ABS_RX"}, {"BTN_TL", "BTN_TRIGGER"})


def test_no_two_names_mean_the_same() -> None:
    for codes in (AXES, BUTTONS):
        assert len(set(codes.values())) == len(codes)
