"""The cycle records of a fault through the loops again: which command differs from what is computed now."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import msgspec

from canhelm.errors import ConfigError, UsageError
from daemon.loops.measurement import Command, Measurement
from daemon.runtime.cycle import LONGEST_STEP
from daemon.runtime.motions import Motion
from daemon.runtime.paired_steer_vehicle import PairedSteerVehicle
from daemon.runtime.vehicle import VehicleState
from daemon.runtime.vehicles import make_vehicle
from drivers.bus.no_bus import NoBus
from drivers.canopen.master import Master
from drivers.devices import Devices
from profiles.schema import Profile

TOLERANCE_M_S = 1e-6
METHODS = ("steer", "drive.parallel", "drive.turn")
"""Of paired steering: motions whose laws heed what was asked for at their begin, and then measurements alone."""


@dataclass(slots=True)
class Recomputed:
    """What came of it.

    Attributes:
        cycles: those with a motion that were computed again.
        left_out: those with a motion that cannot be, by the kind of that motion: it began before the recording, or is
            none of :data:`METHODS`.
        difference: the first command that differs: time, drive, both speeds, limits of then and now; None where all
            are the same.
    """

    cycles: int = 0
    left_out: Counter[str] = field(default_factory=Counter)
    difference: dict[str, Any] | None = None


async def recompute(profile: Profile, lines: Iterable[bytes]) -> Recomputed:
    """Feed each recorded measurement to the vehicle's laws and its gate, and compare; ends at the first difference.

    Args:
        profile: of the robot; another than that of the recording shows where it would have been driven otherwise.
        lines: of ``records.jsonl``.

    Raises:
        UsageError: the robot's laws heed more than the records hold.
        ConfigError: a line is no record, or not of this robot.
    """
    again = _Again(profile)
    for number, line in enumerate(lines, 1):
        try:
            again.take(msgspec.json.decode(line))
        except (msgspec.MsgspecError, RecursionError, KeyError, ValueError, TypeError, AttributeError) as error:
            remedy = "name the records.jsonl of a fault, and by --profile no other kind of robot"
            raise ConfigError(f"line {number} is no record of robot {profile.name}: {error}", remedy=remedy) from error
        if again.found.difference is not None:
            break
    return again.found


class _Again:
    """The control cycle of a robot without devices."""

    def __init__(self, profile: Profile) -> None:
        master = Master(NoBus(profile.network.bit_rate), profile.network)
        self.found = Recomputed()
        self._vehicle = vehicle = make_vehicle(profile, Devices(master, profile))
        if not isinstance(vehicle, PairedSteerVehicle):
            raise UsageError(
                f"the laws of robot {profile.name} cannot be computed again",
                remedy="only those of paired steering can; `canhelm replay` of its frames.log, or `canhelm plot`",
            )
        self._period_s = 1.0 / profile.network.cycle_hz
        self._motions: dict[str, Motion] = {}
        self._previous: Command | None = None
        self._before_s = 0.0

    def take(self, record: Mapping[str, Any]) -> None:
        """One line: a motion that begins, or a cycle."""
        if "begins" in record:
            begins = record["begins"]
            self._begin(begins["motion"], begins["kind"], begins["asked"])
            return
        measurement = msgspec.convert(record["measurement"], Measurement)
        command = msgspec.convert(record["command"], Command)
        running = [step for step in record["motions"] if step["running"]]
        if running and record["state"] == VehicleState.ACTIVE and self._previous is not None:
            unknown = [step["kind"] for step in running if step["motion"] not in self._motions]
            if unknown:
                self.found.left_out[", ".join(unknown)] += 1
            else:
                self._compare(running, measurement, command, record)
        self._vehicle.observe(measurement)
        self._previous, self._before_s = command, measurement.time_s

    def _begin(self, motion: str, kind: str, asked: dict[str, Any]) -> None:
        if kind in METHODS:
            self._motions[motion] = self._vehicle.motion(kind, asked, None)

    def _compare(
        self,
        running: Sequence[Mapping[str, Any]],
        measurement: Measurement,
        command: Command,
        record: Mapping[str, Any],
    ) -> None:
        assert self._previous is not None
        self.found.cycles += 1
        dt_s = min(measurement.time_s - self._before_s, LONGEST_STEP * self._period_s)
        wanted = self._ask(running, measurement, dt_s)
        computed, limits = self._vehicle.gate(wanted, measurement, self._previous, dt_s)
        pairs = zip(command.wheel_speed_m_s, computed.wheel_speed_m_s, strict=True)
        apart = [index for index, (then, now) in enumerate(pairs) if abs(then - now) > TOLERANCE_M_S]
        if apart or command.release_brake != computed.release_brake:
            self.found.difference = {
                "time_s": measurement.time_s,
                "motions": [step["kind"] for step in running],
                "drives": [self._vehicle.drives[index].name for index in apart],
                "recorded": msgspec.to_builtins(command),
                "computed": msgspec.to_builtins(computed),
                "limits_recorded": record["limits"],
                "limits_computed": limits,
            }

    def _ask(self, running: Sequence[Mapping[str, Any]], measurement: Measurement, dt_s: float) -> Command:
        """What the motions want; as the supervisor asks them, of which one at a time moves the vehicle."""
        command = self._vehicle.zero
        for step in running:
            motion = self._motions[step["motion"]]
            if not motion.running:
                motion.begin(measurement.time_s)
            if step["stop_reason"]:
                motion.stop(step["stop_reason"])
            if not motion.ended.done():
                command = motion.step(measurement, dt_s)
        return command
