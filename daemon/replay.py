"""A candump log through the daemon's own decoding: what it read from those frames, and what nodes reported."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from daemon.runtime.vehicles import make_vehicle
from drivers.bus.candump import LogFrame
from drivers.bus.no_bus import NoBus
from drivers.canopen.master import Master, NodeEvent
from drivers.canopen.nmt import SYNC_COB_ID
from drivers.devices import Devices
from profiles.schema import Profile


@dataclass(slots=True)
class Replayed:
    """What a log told.

    Attributes:
        rows: pose by odometry, and each device's reading, by time and name.
        events: what nodes reported: boot-ups, emergencies.
        frames: frames of the log.
        read: of these, how many the daemon reads; others are its own, or of nobody in the profile.
        malformed: of these, how many a device could not have sent.
    """

    rows: list[dict[str, Any]] = field(default_factory=list)
    events: list[dict[str, Any]] = field(default_factory=list)
    frames: int = 0
    read: int = 0
    malformed: int = 0


async def replay(profile: Profile, log: Iterable[LogFrame], every_s: float) -> Replayed:
    """Decode a log as the daemon of a robot decodes its bus; nothing is sent.

    Args:
        profile: the robot.
        log: frames in the order of the bus.
        every_s: least time between two rows; each is taken at a SYNC.
    """
    bus = NoBus(profile.network.bit_rate)
    master = Master(bus, profile.network)
    devices = Devices(master, profile)
    vehicle = make_vehicle(profile, devices)
    replayed = Replayed()
    now_s, begin_s, next_s = 0.0, None, 0.0

    def on_event(event: NodeEvent) -> None:
        told = {"time_s": round(now_s, 6), "severity": event.severity, "event": event.message, "remedy": event.remedy}
        replayed.events.append(told)

    master.on_event = on_event
    assert bus.receiver is not None
    for frame in log:
        begin_s = frame.timestamp_s if begin_s is None else begin_s
        now_s = frame.timestamp_s - begin_s
        replayed.frames += 1
        if frame.can_id == SYNC_COB_ID:
            measurement = vehicle.measure(now_s)
            vehicle.observe(measurement)
            if now_s >= next_s:
                next_s = now_s + every_s
                replayed.rows.append(
                    {"time_s": round(now_s, 6), **vehicle.status().get("odometry", {}), **_read(devices, profile)}
                )
        bus.receiver(frame.can_id, frame.data, now_s)
    replayed.read = replayed.frames - master.counters.unknown
    replayed.malformed = master.counters.malformed
    return replayed


def _read(devices: Devices, profile: Profile) -> dict[str, Any]:
    """The newest reading of each device by its name; currents are positive where the motor pushes forward."""
    readings: dict[str, Any] = {}
    for name, drive in devices.drives.items():
        readings |= {
            f"{name}.state": str(drive.state),
            f"{name}.speed_m_s": round(drive.speed_m_s, 4),
            f"{name}.current_a": round(profile.drives[name].direction * drive.current_a, 3),
        }
    for name, encoder in devices.encoders.items():
        readings[f"{name}.heading_deg"] = round(math.degrees(encoder.heading_rad), 3)
    return readings
