"""Which gamepads and joysticks are plugged into this machine, and whether this user may read them.

Names, axes and buttons come from sysfs, which anybody may read (Linux, Documentation/ABI/testing/sysfs-class-input).
"""

from __future__ import annotations

import grp
import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from canhelm.errors import NodeAbsent, PermissionRefused, UsageError
from profiles.gamepad_codes import AXES, BUTTONS

SYSFS = Path("/sys/class/input")
DEVICES = Path("/dev/input")
UDEV_RULE = """SUBSYSTEM=="input", ENV{ID_INPUT_JOYSTICK}=="1", GROUP="input", MODE="0660", TAG+="uaccess\""""
_CONNECTIONS = {0x03: "usb", 0x05: "bluetooth", 0x06: "virtual"}
_WORD_BITS = 8 * struct.calcsize("l")


@dataclass(frozen=True, slots=True)
class PadInfo:
    """One pad.

    Attributes:
        name: as the kernel calls it.
        path: of its event device.
        connection: usb, bluetooth, virtual or other.
        axes, buttons: those whose names a profile may use.
        readable: whether this user may read it.
        remedy: the line that lets this user read it; empty where that may be.
    """

    name: str
    path: str
    connection: str
    axes: tuple[str, ...]
    buttons: tuple[str, ...]
    readable: bool
    remedy: str


def list_pads() -> list[PadInfo]:
    """Everything with two axes and a button of a gamepad or a joystick, in the order of the event devices."""
    return list(_found())


def choose_pad(wanted: str | None) -> PadInfo:
    """The pad to drive with.

    Args:
        wanted: its name or path; None: the first one that may be read.

    Raises:
        NodeAbsent: there is none, or none of this name.
        PermissionRefused: this user may not read it.
    """
    pads = list_pads()
    if wanted is not None:
        path = os.path.realpath(wanted)
        pads = [pad for pad in pads if wanted == pad.name or path == os.path.realpath(pad.path)]
    if not pads:
        what = "no gamepad is here" if wanted is None else f"no gamepad {wanted!r} is here"
        listed = "; `canhelm drive joystick --list` shows what is there"
        raise NodeAbsent(what, remedy=no_pad_remedy() + listed)
    pad = next((pad for pad in pads if pad.readable), pads[0])
    if not pad.readable:
        raise PermissionRefused(f"this user may not read {pad.path} ({pad.name})", remedy=pad.remedy)
    return pad


def no_pad_remedy() -> str:
    """What to do where no pad is found."""
    if DEVICES.is_dir():
        return "plug it in or switch it on"
    return f"there is no {DEVICES}: the kernel has no event devices, or this container does not have them"


def require_parts(pad: PadInfo, axes: set[str], buttons: set[str]) -> None:
    """Raise UsageError where a pad lacks an axis or a button that the robot's profile names."""
    missing = sorted(axes - set(pad.axes)) + sorted(buttons - set(pad.buttons))
    if missing:
        raise UsageError(
            f"{pad.name} has no {', '.join(missing)}",
            remedy=f"name others in gamepad: of the robot's profile; it has {', '.join((*pad.axes, *pad.buttons))}",
        )


def _found() -> Iterator[PadInfo]:
    for folder in sorted(SYSFS.glob("event*"), key=lambda path: (len(path.name), path.name)):
        try:
            pad = _pad(folder)
        except OSError:
            continue  # it is just going away
        if {"ABS_X", "ABS_Y"} <= set(pad.axes) and pad.buttons:
            yield pad


def _pad(folder: Path) -> PadInfo:
    device, path = folder / "device", DEVICES / folder.name
    axes, buttons = (set_bits((device / "capabilities" / kind).read_text()) for kind in ("abs", "key"))
    readable = os.access(path, os.R_OK)
    return PadInfo(
        name=(device / "name").read_text().strip(),
        path=str(path),
        connection=_CONNECTIONS.get(int((device / "id" / "bustype").read_text(), 16), "other"),
        axes=tuple(name for name, code in AXES.items() if code in axes),
        buttons=tuple(name for name, code in BUTTONS.items() if code in buttons),
        readable=readable,
        remedy="" if readable else _remedy(path),
    )


def set_bits(text: str, word_bits: int = _WORD_BITS) -> set[int]:
    """Numbers of the bits that are set in a bitmap of sysfs: hexadecimal words of a long, the highest first."""
    words = [int(word, 16) for word in reversed(text.split())]
    return {word_bits * index + bit for index, word in enumerate(words) for bit in range(word_bits) if word >> bit & 1}


def _remedy(path: Path) -> str:
    try:
        group = grp.getgrgid(path.stat().st_gid).gr_name
    except (OSError, KeyError):
        return "there is no device file for it: see that udev runs"
    if group != "root":
        return f"sudo usermod -aG {group} $USER, then log in again"
    rule = f"echo '{UDEV_RULE}' | sudo tee /etc/udev/rules.d/70-gamepad.rules"
    return f"{rule}; sudo udevadm control --reload; sudo udevadm trigger; sudo usermod -aG input $USER"
