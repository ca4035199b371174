"""What the API serves: the vehicle's status, its leases and its methods, in one place."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from daemon.runtime.clock import pace, stood_still_s
from daemon.runtime.commands import Commands
from daemon.runtime.cycle import Cycle
from daemon.runtime.localising import Localiser
from daemon.runtime.recorder import BusRecorder
from daemon.runtime.run_recorder import RunRecorder
from daemon.runtime.supervisor import Supervisor
from daemon.runtime.vehicle_view import view_of
from drivers.bus.contract import Bus

EVENTS_SHOWN = 10


class Service:
    """One robot's daemon as its clients see it.

    Args:
        robot: the profile's name.
        supervisor: state, motions and leases.
        commands: the methods.
        bus: for load and counters.
        cycle: for its counters.
        profile_file: where the robot's profile stands.

    Attributes:
        recorder: of every frame; None where nothing is recorded.
        runs: of every motion; None where they are not kept.
        localiser: of the vehicle; None where its pose is the odometry's.
        found: what a first look at a bus without a profile has found.
    """

    def __init__(
        self,
        robot: str,
        supervisor: Supervisor,
        commands: Commands,
        bus: Bus,
        cycle: Cycle,
        profile_file: Path | None = None,
    ) -> None:
        self.robot = robot
        self.recorder: BusRecorder | None = None
        self.runs: RunRecorder | None = None
        self.localiser: Localiser | None = None
        self.found: list[dict[str, Any]] = []
        self.call = commands.call
        self.open_lease = supervisor.open_lease
        self.renew_lease = supervisor.renew_lease
        self.close_lease = supervisor.close_lease
        self.end_lease = supervisor.end_lease
        self.take_lease = supervisor.take_lease
        self._supervisor = supervisor
        self._bus = bus
        self._cycle = cycle
        self._profile_file = profile_file

    @property
    def state(self) -> str:
        """The vehicle's state."""
        return self._supervisor.state.value

    @property
    def sentence(self) -> str:
        """How the vehicle is, in one short line."""
        return self._supervisor.sentence

    @property
    def lease_timeout_s(self) -> float:
        """How long a motion goes on without a renewal."""
        return self._supervisor.lease_timeout_s

    @property
    def events(self) -> list[Callable[[dict[str, Any]], None]]:
        """Callbacks that hear of each event."""
        return self._supervisor.log.listeners

    def status(self) -> dict[str, Any]:
        """Everything at a glance; keys carry units, values are plain JSON."""
        supervisor = self._supervisor
        return {
            "robot": self.robot,
            "profile_file": str(self._profile_file) if self._profile_file else None,
            "setup": supervisor.vehicle.profile.setup,
            "state": self.state,
            "message": supervisor.message,
            "time_s": round(asyncio.get_running_loop().time(), 3),
            "pace": pace(),
            "nodes": [device.status() for device in supervisor.devices.all],
            "bricks": [{"name": name, **brick.status()} for name, brick in supervisor.devices.bricks.items()],
            "brakes": [brake.status() for brake in supervisor.devices.brakes.values()],
            "vehicle": {**supervisor.vehicle.status(), **view_of(supervisor.vehicle, supervisor.motions.values())},
            "found": self.found,
            "localisation": self.localiser.status() if self.localiser else None,
            "holder": supervisor.holder(),
            "limits_active": list(supervisor.active_limits),
            "motions": [motion.summary() for motion in supervisor.motions.values()],
            "bus": self._bus_status(),
            "cycle": self._cycle_status(),
            "recording": self.recorder.status() if self.recorder else None,
            "runs": self.runs.status() if self.runs else None,
            "events": supervisor.log.last(EVENTS_SHOWN),
        }

    def _bus_status(self) -> dict[str, Any]:
        return {
            "name": self._bus.name,
            "bit_rate": self._bus.bit_rate,
            "load": round(self._bus.load(), 4),
            **asdict(self._bus.counters),
            **self._bus.details(),
            **asdict(self._supervisor.master.counters),
        }

    def _cycle_status(self) -> dict[str, Any]:
        counters = self._cycle.counters
        return {
            "hz": round(1.0 / self._cycle.period_s, 3),
            "achieved_hz": round(counters.achieved_hz, 2),
            "cycles": counters.cycles,
            "late_cycles": counters.late_cycles,
            "incomplete_cycles": counters.incomplete,
            "max_lateness_ms": round(counters.max_lateness_s * 1e3, 3),
            "stood_still_s": round(stood_still_s(), 3),
        }
