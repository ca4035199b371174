"""Watches the devices of a vehicle: which fault stops it, which silence does, and which it only waits out."""

from __future__ import annotations

import math

from canhelm.errors import DeviceFault
from drivers.bus.contract import Bus
from drivers.canopen.device import CanopenDevice
from drivers.canopen.master import NodeEvent
from drivers.contract import Device, NodeState
from drivers.devices import Devices

SILENT_CYCLES = 5
"""Control cycles without a reading after which a node counts as silent while something moves.

Cycles count, not time: while the daemon itself stands still nobody asks, and while a request to a dead node keeps a
serial line there are few of them. A pause that is too long for the drives is theirs to notice, by life guarding."""
LATE_CYCLES = 2
"""Cycles between two looks from which on the daemon itself counts as late."""


OLD_S = 10.0
"""An older reading tells nothing of how soon the stop came: its node was away since, or this program stood still."""


class _Unread:
    """Looks at a device since its last reading."""

    __slots__ = ("cycles", "since_s")

    def __init__(self) -> None:
        self.since_s, self.cycles = -math.inf, 0


class DeviceWatch:
    """Finds the first reason to stop.

    Args:
        devices: all devices.
        period_s: the control cycle's period.
        bus: on which they are.
        late_after_cycles: see ``Network.late_after_cycles``.
    """

    def __init__(self, devices: Devices, period_s: float, bus: Bus, late_after_cycles: float = 1.0) -> None:
        self._bus = bus
        self._by_node = devices.by_node
        self._period_s = period_s
        self._late_s = LATE_CYCLES * late_after_cycles * period_s
        self._unread = [(device, _Unread()) for device in devices.by_node.values()]
        self._looked_s: float | None = None
        self._stall_end_s = -math.inf
        self._stall_s = 0.0

    def look(self, now_s: float, *, powered: bool) -> DeviceFault | None:
        """The fault that stops the vehicle, or None.

        Args:
            now_s: loop time.
            powered: whether a motion runs or any drive has its power stage on. While nothing is powered, a node that
                goes away is waited for and needs no reset.
        """
        if self._looked_s is not None and now_s - self._looked_s > self._late_s:
            self._stall_end_s, self._stall_s = now_s, now_s - self._looked_s - self._period_s
        self._looked_s = now_s
        for device, unread in self._unread:
            fault = device.fault
            if fault is not None and (powered or fault.code != 0):
                return DeviceFault(fault.message, node=fault.node, value=fault.code or None, remedy=fault.remedy)
            if device.reading_time_s != unread.since_s:
                unread.since_s, unread.cycles = device.reading_time_s, 0
                continue
            unread.cycles += 1
            if unread.cycles > SILENT_CYCLES and powered and device.node_state is NodeState.READY:
                return self._silence(device, *self._who_is_silent(device), now_s)
        return None

    def _who_is_silent(self, device: CanopenDevice) -> tuple[str, str]:
        """What is silent, and what to do: the interface, all nodes, or this one."""
        trouble = self._bus.trouble
        if trouble is not None:
            return trouble.message, trouble.remedy or ""
        if all(unread.cycles >= SILENT_CYCLES for _, unread in self._unread):
            return "no node answers", "check the cable to the robot, and its power"
        return f"{device.who} is silent", "check its power and the CAN cable"

    def lost(self, event: NodeEvent) -> DeviceFault | None:
        """The fault that an event about a node means for a vehicle that is powered, or None."""
        device = self._by_node.get(event.node)
        if event.kind not in ("lost", "rebooted") or device is None:
            return None
        return self._silence(device, event.message, event.remedy, event.time_s)

    def _silence(self, device: Device, what: str, remedy: str, now_s: float) -> DeviceFault:
        """The fault; it tells where the daemon was late itself since the last reading, as then nobody listened."""
        age_s = now_s - device.reading_time_s
        if age_s < OLD_S:
            what = f"{what}; stop commanded {age_s * 1e3:.0f} ms after its last reading"
        if self._stall_end_s >= device.reading_time_s > -math.inf:
            what = f"{what}; the daemon itself was {self._stall_s * 1e3:.0f} ms late meanwhile"
            remedy = f"look for what loads this machine: `canhelm doctor`; else {remedy}"
        return DeviceFault(what, node=device.node, remedy=remedy)
