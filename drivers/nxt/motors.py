"""The motors of a brick as drives: read one after the other, and given their newest speeds after each round.

A drive whose target is 0 is not told again and again: a motor that a move has left alone keeps the brick's count.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

from canhelm.errors import CanhelmError, Refused
from drivers.contract import DriveState, Fault, NodeState
from drivers.nxt.brick import Brick
from drivers.nxt.codes import Output
from drivers.nxt.power import regulated_power
from drivers.nxt.replies import OutputState
from profiles.bricks import NxtMotorConfig

TARGETS_WITHIN_S: Final = 0.2
"""Where the control cycle gives no targets for so long after a reading, none are sent: those of before run out."""
RETRY_S: Final = 0.1
SPEED_WINDOW_S: Final = 0.1
"""Shortest time over which a speed is taken: the counters count degrees."""
_NO_SUCH = "an NXT motor is driven by `canhelm motor velocity`, or with its wheel by `canhelm nxt`"


class NxtDrive:
    """One motor with its wheel; fulfils :class:`drivers.contract.Drive`. Its current is not measured.

    Args:
        name: its name in the profile.
        brick: that it is plugged into.
        config: output and wheel.
        brick_name: the brick's name in the profile.

    Attributes:
        tacho_deg: the brick's count; None before the first reading.
        on_target: called when a target is complete.
    """

    node: None = None
    emergency_stop = ""

    def __init__(self, name: str, brick: Brick, config: NxtMotorConfig, brick_name: str) -> None:
        self.name = name
        self.brick = brick
        self.output = Output[config.output]
        self.config = config
        self.fault: Fault | None = None
        self.reading_time_s = -math.inf
        self.position_m = 0.0
        self.speed_m_s = 0.0
        self.current_a = 0.0
        self.target_speed_m_s = 0.0
        self.tacho_deg: int | None = None
        self.on_target: Callable[[], None] | None = None
        self._brick_name = brick_name
        self._per_degree_m = config.direction * math.radians(1.0) * config.wheel_radius_m
        self._connection = self._enabled_in = -1
        self._mark = (-math.inf, 0.0)

    @property
    def node_state(self) -> NodeState:
        """That of its brick."""
        return self.brick.node_state

    @property
    def status_sentence(self) -> str:
        """That of its brick."""
        return f"brick {self._brick_name}: {self.brick.status_sentence}"

    @property
    def state(self) -> DriveState:
        """Enabled until its brick is connected anew, which stops all motors."""
        if self.node_state is not NodeState.READY:
            return DriveState.UNKNOWN
        return DriveState.ENABLED if self._enabled_in == self.brick.connections else DriveState.DISABLED

    def require_ready(self) -> None:
        """Raise NodeAbsent or NotReady unless the brick is connected and known."""
        self.brick.require_ready()

    def read(self, state: OutputState, now_s: float) -> None:
        """Take a reading; the first one of a connection sets the start, as the brick may have been switched off."""
        if self._connection != self.brick.connections or self.tacho_deg is None:
            self._connection, self.tacho_deg = self.brick.connections, state.tacho_deg
            self._mark, self.speed_m_s = (now_s, self.position_m), 0.0
        self.position_m += (state.tacho_deg - self.tacho_deg) * self._per_degree_m
        self.tacho_deg = state.tacho_deg
        self.reading_time_s = now_s
        since_s, from_m = self._mark
        if now_s - since_s >= SPEED_WINDOW_S:
            self.speed_m_s = (self.position_m - from_m) / (now_s - since_s)
            self._mark = (now_s, self.position_m)

    @property
    def power(self) -> int:
        """Power for the target: 100 for 1000 degrees a second."""
        return regulated_power(self.config.direction * self.target_speed_m_s / self.config.wheel_radius_m)

    def command_speed(self, speed_m_s: float) -> None:
        """Take a target speed at the rim."""
        self.target_speed_m_s = speed_m_s

    def transmit(self, deadline_s: float) -> None:
        """The targets of this control cycle are complete; they go out when the brick has been read."""
        if self.on_target is not None:
            self.on_target()

    def quick_stop(self) -> None:
        """Brake the motor at once; a move of the brick fails."""
        self.target_speed_m_s = 0.0
        self.brick.stop(port=self.output)

    async def insist_on_stop(self) -> None:
        """Nothing to do: the brick acknowledges what it was told."""

    async def enable(self) -> None:
        """Let it be driven. Raises NodeAbsent, NotReady (as with a battery that is too low)."""
        self.brick.require_ready()
        self.brick.require_battery()
        self.target_speed_m_s = 0.0
        self._enabled_in = self.brick.connections

    async def disable(self) -> None:
        """Take the motor's power away when it has come to rest; then, or after three seconds of turning, it coasts."""
        self.target_speed_m_s = 0.0
        try:
            await self.brick.until_rest((self.output,))
        finally:
            self._enabled_in = -1
            if self.node_state is NodeState.READY:
                self.brick.release(self.output)

    async def reset_fault(self) -> None:
        """Nothing to do: the brick knows no faults."""

    async def set_current(self, current_a: float) -> None:
        """Raises Refused: the brick has no current control."""
        raise Refused(f"{self.name} has no current control", remedy=_NO_SUCH)

    async def move_to(self, position_qc: int, *, relative: bool, speed_rpm: float) -> None:
        """Raises Refused: the brick counts, but knows no positions."""
        raise Refused(f"{self.name} has no position control", remedy=_NO_SUCH)

    async def home(self, method: int) -> None:
        """Raises Refused: there is no reference."""
        raise Refused(f"{self.name} has no homing", remedy=_NO_SUCH)

    @property
    def at_target(self) -> bool:
        """Never: there are no moves to positions."""
        return False

    async def use_driving_mode(self) -> None:
        """It has one mode only: back to a zero target."""
        self.target_speed_m_s = 0.0

    def rpm_from_speed(self, speed_m_s: float) -> float:
        """Motor speed in rpm for a rim speed."""
        return self.config.direction * speed_m_s / self.config.wheel_radius_m * 60 / math.tau

    def speed_from_rpm(self, speed_rpm: float) -> float:
        """Rim speed for a motor speed in rpm."""
        return self.config.direction * speed_rpm * self.config.wheel_radius_m * math.tau / 60

    def status(self) -> dict[str, Any]:
        """Everything about the motor; keys carry units."""
        return {
            "node": None,
            "name": self.name,
            "device": f"NXT motor {self.output.name}",
            "node_state": str(self.node_state),
            "status": self.status_sentence,
            "fault": None,
            "brick": self._brick_name,
            "state": str(self.state),
            "velocity_rpm": round(self.rpm_from_speed(self.speed_m_s), 1) + 0.0,
            "speed_m_s": round(self.speed_m_s, 4) + 0.0,
            "target_speed_m_s": round(self.target_speed_m_s, 4) + 0.0,
            "position_m": round(self.position_m, 5) + 0.0,
            "tacho_deg": self.tacho_deg,
        }


class MotorCycle:
    """Reads the motors of a brick round by round and sends what the control cycle makes of each round.

    Args:
        brick: the brick.
        drives: its motors, in the order in which they are read.

    Attributes:
        rounds: rounds so far.
    """

    def __init__(self, brick: Brick, drives: Iterable[NxtDrive]) -> None:
        self.rounds = 0
        self._brick = brick
        self._drives: Mapping[int, NxtDrive] = {drive.output: drive for drive in drives}
        self._sent: dict[Output, int] = {}
        self._task: asyncio.Task[None] | None = None
        self._given = asyncio.Event()
        brick.on_output = self._on_output
        for drive in self._drives.values():
            drive.on_target = self._given.set

    def start(self) -> None:
        """Begin, on the running loop; the brick is connected whenever it can be."""
        self._brick.start()
        name = f"motors of {self._brick.name}"
        self._task = asyncio.get_running_loop().create_task(self._live(), name=name)

    async def close(self) -> None:
        """Stop the motors and end the connection."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])
            self._task = None
        await self._brick.close()

    def _on_output(self, state: OutputState) -> None:
        drive = self._drives.get(state.port)
        if drive is not None:
            drive.read(state, asyncio.get_running_loop().time())

    async def _live(self) -> None:
        while True:
            await self._brick.wait_still()
            if self._brick.node_state is not NodeState.READY:
                self._sent.clear()
                for drive in self._drives.values():
                    drive.speed_m_s = 0.0
            await self._brick.wait_ready()
            try:
                await self._round()
            except CanhelmError:  # the brick tells what is wrong with its connection
                await asyncio.sleep(RETRY_S)

    async def _round(self) -> None:
        for drive in self._drives.values():
            await self._brick.output(drive.output)
        self.rounds += 1
        self._given.clear()
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(TARGETS_WITHIN_S):  # wait_for loses a cancellation at the moment that it ends
                await self._given.wait()
            self._send()

    def _send(self) -> None:
        """Speeds of the motors that turn, or did until now."""
        enabled = [drive for drive in self._drives.values() if drive.state is DriveState.ENABLED]
        powers = {drive.output: drive.power for drive in enabled}
        changed = {port: power for port, power in powers.items() if power or self._sent.get(port)}
        if changed and not self._brick.moving:
            self._brick.run(changed)
        self._sent = powers
