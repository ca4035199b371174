"""Watches the devices of a vehicle: which fault stops it, which silence does, and which it only waits out."""

from __future__ import annotations

from canhelm.errors import DeviceFault
from drivers.canopen.master import NodeEvent
from drivers.contract import Device, NodeState
from drivers.devices import Devices

SILENT_CYCLES = 5
"""Cycles without a reading after which a node counts as silent while something moves."""


class DeviceWatch:
    """Finds the first reason to stop.

    Args:
        devices: all devices.
        period_s: the control cycle's period.
    """

    def __init__(self, devices: Devices, period_s: float) -> None:
        self._devices = tuple(devices.by_node.values())
        self._by_node = devices.by_node
        self._silent_s = SILENT_CYCLES * period_s

    def look(self, now_s: float, *, powered: bool) -> DeviceFault | None:
        """The fault that stops the vehicle, or None.

        Args:
            now_s: loop time.
            powered: whether a motion runs or any drive has its power stage on. While nothing is powered, a node that
                goes away is waited for and needs no reset.
        """
        for device in self._devices:
            fault = device.fault
            if fault is not None and (powered or fault.code != 0):
                return DeviceFault(fault.message, node=fault.node, value=fault.code or None, remedy=fault.remedy)
            if powered and device.node_state is NodeState.READY and now_s - device.reading_time_s > self._silent_s:
                return _silence(device, now_s)
        return None

    def lost(self, event: NodeEvent) -> DeviceFault | None:
        """The fault that an event about a node means for a vehicle that is powered, or None."""
        device = self._by_node.get(event.node)
        if event.kind not in ("lost", "rebooted") or device is None:
            return None
        silent_ms = (event.time_s - device.reading_time_s) * 1e3
        return DeviceFault(
            f"{event.message}; stop commanded {silent_ms:.0f} ms after its last reading",
            node=event.node,
            remedy=event.remedy,
        )


def _silence(device: Device, now_s: float) -> DeviceFault:
    silent_ms = (now_s - device.reading_time_s) * 1e3
    return DeviceFault(
        f"node {device.node} ({device.name}) is silent; stop commanded {silent_ms:.0f} ms after its last reading",
        node=device.node,
        remedy="check its power and the CAN cable",
    )
