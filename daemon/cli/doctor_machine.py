"""The doctor's look at this machine: Python, groups, CAN interfaces and the modules of their adapters."""

from __future__ import annotations

import errno
import getpass
import grp
import os
import socket
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from daemon.cli.finding import Finding
from drivers.bus.can_link import CanLink, read_link

OLDEST_PYTHON = (3, 11)
NETWORK_DEVICES = Path("/sys/class/net")
USB_DEVICES = Path("/sys/bus/usb/devices")
DRIVERS = {
    ("1d50", "606f"): "gs_usb",
    ("1209", "2323"): "gs_usb",
    ("0c72", ""): "peak_usb",
    ("0bfd", ""): "kvaser_usb",
}
"""Modules of USB adapters by vendor and product: candleLight, PEAK, Kvaser (Linux, drivers/net/can/usb)."""
ARPHRD_CAN = "280"
IFF_UP = 1
WANTED_QUEUE = 100
"""Frames; the kernel's default of 10 is less than one control cycle of a robot sends."""
RESTART_MS = 100
"""Delay after which a controller that went bus-off tries again."""


def machine_findings() -> Iterator[Finding]:
    """Python and the group that may use the daemon's socket."""
    version = ".".join(str(part) for part in sys.version_info[:3])
    fits = sys.version_info >= OLDEST_PYTHON
    yield Finding("python", "ok" if fits else "problem", version, "" if fits else "install Python 3.11 or newer")
    try:
        members = grp.getgrnam("canhelm")
    except KeyError:
        yield Finding(
            "group", "note", "there is no group canhelm: sockets stay with their user", "sudo groupadd canhelm"
        )
        return
    user = getpass.getuser()
    if user in members.gr_mem or os.getuid() == 0 or members.gr_gid in os.getgroups():
        yield Finding("group", "ok", f"{user} may use daemons of the group canhelm")
    else:
        yield Finding("group", "note", f"{user} is not in the group canhelm", f"sudo usermod -aG canhelm {user}")


def kernel_has_can() -> bool:
    """Whether this kernel can open CAN sockets, now or by a module that it loads for it."""
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError as error:
        return error.errno not in (errno.EAFNOSUPPORT, errno.EPROTONOSUPPORT)
    return True


def _names(devices: Path) -> list[str]:
    return [path.name for path in sorted(devices.glob("*")) if _read(path / "type") == ARPHRD_CAN]


def interface_findings(devices: Path, *, has_can: bool = True) -> Iterator[Finding]:
    """The CAN interfaces that the kernel lists.

    Args:
        devices: ``/sys/class/net``.
        has_can: whether the kernel can open CAN sockets.
    """
    names = _names(devices)
    if not has_can:
        mend = "sudo modprobe can_raw; where that is missing: sudo apt install linux-modules-extra-$(uname -r)"
        yield Finding("can", "note", "this kernel has no CAN; the simulated bus and serial adapters need none", mend)
    elif not names:
        mend = "plug in an adapter, or: sudo modprobe vcan && sudo ip link add vcan0 type vcan"
        yield Finding("can", "note", "no CAN interface; the simulated bus needs none", mend)
    for name in names:
        yield interface_finding(name, devices / name, read_link(name))


def interface_finding(name: str, folder: Path, link: CanLink) -> Finding:
    """One CAN interface: up, not bus-off, and with a queue that holds a cycle's frames.

    Args:
        name: of the interface.
        folder: of its attributes.
        link: what the kernel tells of it.
    """
    rate, state = link.bit_rate, link.state
    queue = int(_read(folder / "tx_queue_len") or 0)
    shown = f"{rate} bit/s, {state or 'state unknown'}, queue of {queue}" if rate else f"queue of {queue}"
    if not int(_read(folder / "flags") or "0", 16) & IFF_UP:
        virtual = rate is None and name.startswith("vcan")
        set_up = "" if virtual else f" type can bitrate {rate or 1000000} restart-ms {RESTART_MS}"
        return Finding(name, "problem", f"down, {shown}", f"sudo ip link set {name} up{set_up}")
    if state == "BUS-OFF":
        mend = f"check cable, termination and bit rate, then: sudo ip link set {name} down; sudo ip link set {name} up"
        return Finding(name, "problem", shown, mend)
    if state in ("ERROR-PASSIVE", "ERROR-WARNING"):
        return Finding(name, "note", shown, "check cable, termination, bit rate, and that a node has power")
    if queue < WANTED_QUEUE:
        return Finding(name, "note", shown, f"sudo ip link set {name} txqueuelen {WANTED_QUEUE}")
    if rate and link.restart_ms == 0:
        mend = f"{name} type can restart-ms {RESTART_MS}; sudo ip link set {name} up"
        mend = f"sudo ip link set {name} down; sudo ip link set {mend}"
        return Finding(name, "note", f"up, {shown}, stays bus-off once it is", mend)
    return Finding(name, "ok", f"up, {shown}")


def adapter_findings(devices: Path) -> Iterator[Finding]:
    """USB adapters that are plugged in and have no interface, because their driver is not loaded.

    Args:
        devices: ``/sys/bus/usb/devices``.
    """
    for path in sorted(devices.glob("*")):
        vendor, product = _read(path / "idVendor"), _read(path / "idProduct")
        module = DRIVERS.get((vendor, product)) or DRIVERS.get((vendor, ""))
        if module is not None and not any(path.glob("*/net/*")):
            found = f"{_read(path / 'product') or 'a CAN adapter'} ({vendor}:{product}) has no interface"
            yield Finding("adapter", "problem", found, f"sudo modprobe {module}")


def name_findings(bus: Mapping[str, Any], devices: Path) -> Iterator[Finding]:
    """A daemon's interface that does not exist, while others do.

    Args:
        bus: of the daemon's status.
        devices: ``/sys/class/net``.
    """
    name, others = str(bus.get("name")), _names(devices)
    if bus.get("down") and others and not name.startswith("tty") and not (devices / name).exists():
        spec = f"socketcan:{others[0]}"
        mend = f"canhelm run --bus {spec} ...; for a service CANHELM_BUS={spec} in its .env"
        yield Finding("name", "problem", f"there is no interface {name}, but {', '.join(others)}", mend)


def bit_rate_findings(bus: Mapping[str, Any], link: CanLink) -> Iterator[Finding]:
    """Whether the interface has the bit rate that the daemon's profile gives.

    Args:
        bus: of the daemon's status.
        link: what the kernel tells of that interface.
    """
    name, wanted, rate = bus.get("name"), bus.get("bit_rate"), link.bit_rate
    if rate and rate != wanted:
        set_up = f"sudo ip link set {name} up type can bitrate {wanted} restart-ms {RESTART_MS}"
        mend = f"sudo ip link set {name} down; {set_up}"
        yield Finding("bit rate", "problem", f"{name} has {rate} bit/s, the profile says {wanted}", mend)


def _read(path: Path) -> str:
    try:
        return path.read_text().strip()
    except OSError:
        return ""
