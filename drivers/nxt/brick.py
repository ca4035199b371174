"""One NXT brick: its connection and who keeps it, its battery, its motors.

The brick does not notice that its host is gone: a motor that was told to run for ever does. So nothing here runs for
ever. A move has the tacho limit of its end, and a speed that is set over and over again one of where the motor will be
a moment later: without the next one the brick stops by itself. A new connection begins with stopping the motors.

Limits are measured from where the last limited run was to end, not from where the motor is (LEGO firmware): so a run
makes up for what the one before has overshot, but after one that was broken off it would finish that first. Where this
may be so, the run begins without a limit, which takes the brick's count along, and the limit follows.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final, TypeVar

from canhelm.errors import BusOff, CanhelmError, NodeAbsent, NotReady, Refused, Timeout
from drivers.contract import NodeState
from drivers.nxt import replies, requests
from drivers.nxt.codes import Output, OutputMode, Regulation, RunState
from drivers.nxt.layout import Telegram
from drivers.nxt.line import REPLY_TIMEOUT_S, BrickLine, Port
from drivers.nxt.power import FULL_SPEED_DEG_S, move_order

PUSHED_DEG: Final = 3
"""A motor that has turned farther since it came to rest was turned by somebody."""
REST_TIMEOUT_S: Final = 3.0
_BRAKED: Final = OutputMode.MOTOR_ON | OutputMode.BRAKE
_DRIVEN: Final = _BRAKED | OutputMode.REGULATED
_CHARGE: Final = "charge or change the battery"

T = TypeVar("T", bound=Telegram)
OnLost = Callable[[str], None]
"""Takes the reason why a connection has vanished."""
Legs = Mapping[Output, tuple[float, float]]
"""Power and angle [deg] by motor; the angle's sign is the direction."""


@dataclass(frozen=True, slots=True)
class BrickSettings:
    """How the connection is kept; the voltages are assumed, for the rechargeable battery as for six cells.

    Attributes:
        reply_timeout_s: longest time to wait for a reply.
        reconnect_s: between two tries to connect.
        watch_s: between two keep-alives, each with a look at the battery.
        warn_v: battery voltage below which the brick's status says so.
        refuse_v: below which no move begins.
        reach_s: how long a speed lasts that is not set again.
    """

    reply_timeout_s: float = REPLY_TIMEOUT_S
    reconnect_s: float = 1.0
    watch_s: float = 5.0
    warn_v: float = 6.9
    refuse_v: float = 6.3
    reach_s: float = 0.8


class Brick:
    """The driver of one brick.

    Args:
        name: how people call it, for instance its device.
        connect: makes the port, on the running loop; it calls its argument with the reason when the connection
            vanishes. Raises BusOff where there is none to be had.
        settings: how the connection is kept.

    Attributes:
        node_state: ABSENT, CONFIGURING while it is asked who it is, READY.
        status_sentence: what is wrong or being done, for people.
        info, firmware: what it says about itself; None before it was asked.
        battery_v: its last reading; nan before the first.
        connections, losses: how often it was connected and lost.
        on_change: called when it has come or gone, or its battery is low, with the sentence.
        on_output: called with each reading of a motor.
    """

    def __init__(self, name: str, connect: Callable[[OnLost], Port], settings: BrickSettings = BrickSettings()) -> None:
        self.name = name
        self.settings = settings
        self.node_state = NodeState.ABSENT
        self.status_sentence = "not connected yet"
        self.info: replies.DeviceInfo | None = None
        self.firmware: replies.FirmwareVersion | None = None
        self.battery_v = math.nan
        self.connections = 0
        self.losses = 0
        self.on_change: Callable[[str], None] | None = None
        self.on_output: Callable[[replies.OutputState], None] | None = None
        self._connect = connect
        self._line: BrickLine | None = None
        self._life: asyncio.Task[None] | None = None
        self._ready = asyncio.Event()
        self._stops = 0
        self._still = asyncio.Event()
        self._still.set()
        self._loose = set(Output) - {Output.ALL}
        self._counts: dict[Output, int] = {}
        self._left_at: dict[Output, int] = {}

    # --- the connection ----------------------------------------------------------------------------------------------

    def start(self) -> None:
        """Connect, and connect again whenever the connection is lost."""
        if self._life is None:
            self._life = asyncio.get_running_loop().create_task(self._live(), name=f"brick {self.name}")

    async def close(self) -> None:
        """Stop the motors and end the connection; returns when the brick has heard it, or will not any more."""
        line = self._line
        if line is not None and not line.dead.done():
            self.stop()
            with contextlib.suppress(CanhelmError):
                await line.ask(requests.KeepAlive())
            line.give_up(BusOff(f"the connection to {self.name} was closed"))
        if self._life is not None:
            self._life.cancel()
            await asyncio.wait([self._life])
            self._life = None
        self.node_state = NodeState.ABSENT
        self._ready.clear()

    async def wait_ready(self) -> None:
        """Return when the brick is connected."""
        await self._ready.wait()

    async def _live(self) -> None:
        while True:
            try:
                await self._serve()
            except CanhelmError as error:
                self._lose(error)
            await asyncio.sleep(self.settings.reconnect_s)

    async def _serve(self) -> None:
        """One connection from its beginning to its end, which is always an error."""
        line: BrickLine | None = None

        def on_lost(reason: str) -> None:
            if line is not None:
                line.lose(reason)

        line = self._line = BrickLine(self._connect(on_lost), self.name, self.settings.reply_timeout_s)
        try:
            await self._greet()
            while True:
                ended, _ = await asyncio.wait([line.dead], timeout=self.settings.watch_s)
                if ended:
                    raise line.dead.result()
                await self.ask(requests.KeepAlive())
                await self.read_battery()
        finally:
            line.give_up(BusOff(f"the connection to {self.name} was closed"))

    async def _greet(self) -> None:
        self.node_state = NodeState.CONFIGURING
        self.stop()
        self.firmware = await self._read(requests.GetFirmwareVersion(), replies.FirmwareVersion)
        self.info = await self._read(requests.GetDeviceInfo(), replies.DeviceInfo)
        await self.ask(requests.KeepAlive())
        await self.read_battery()
        self.connections += 1
        self.node_state = NodeState.READY
        self._ready.set()
        self._tell(f"{self.info.name} is connected, battery {self.battery_v:.1f} V")

    def _lose(self, error: CanhelmError) -> None:
        """Tell it once, however often it is tried again in vain."""
        was_ready, self.node_state = self._ready.is_set(), NodeState.ABSENT
        self._ready.clear()
        self._stops += 1
        self._line = None
        if was_ready:
            self.losses += 1
        if was_ready or self.status_sentence != str(error):
            self._tell(str(error))

    def _tell(self, sentence: str) -> None:
        self.status_sentence = sentence
        if self.on_change is not None:
            self.on_change(sentence)

    def require_ready(self) -> None:
        """Raise NodeAbsent or NotReady unless the brick is connected and known."""
        if self.node_state is NodeState.ABSENT:
            raise NodeAbsent(f"no brick on {self.name}: {self.status_sentence}", remedy="it is tried again by itself")
        if self.node_state is not NodeState.READY:
            raise NotReady(f"the brick on {self.name} is being asked who it is", remedy="try again in a second")

    def status(self) -> dict[str, Any]:
        """Everything about the brick; keys carry units."""
        status: dict[str, Any] = {"name": self.name, "state": self.node_state, "sentence": self.status_sentence}
        status |= {"battery_v": self.battery_v, "battery_low": self.battery_low}
        status |= {"connections": self.connections, "losses": self.losses}
        if self._line is not None:
            status["line"] = asdict(self._line.counters)
        if self.info is not None and self.firmware is not None:
            version = f"{self.firmware.firmware_major}.{self.firmware.firmware_minor:02d}"
            status |= {"brick": self.info.name, "address": self.info.address, "firmware": version}
        return status

    # --- requests ----------------------------------------------------------------------------------------------------

    async def ask(self, content: Telegram) -> Telegram | None:
        """Send any request and wait for its reply.

        Raises:
            Aborted: the brick refused.
            NodeAbsent, Timeout, BusOff, NotReady: it cannot be reached, or could not in time.
        """
        return await self._connected().ask(content)

    async def _read(self, content: Telegram, kind: type[T]) -> T:
        reply = await self.ask(content)
        assert isinstance(reply, kind)
        return reply

    def _connected(self) -> BrickLine:
        if self._line is None:
            self.require_ready()
        assert self._line is not None
        return self._line

    async def output(self, port: Output) -> replies.OutputState:
        """Read a motor."""
        state = await self._read(requests.GetOutputState(port), replies.OutputState)
        self._counts[port] = state.tacho_deg
        if self.on_output is not None:
            self.on_output(state)
        return state

    async def until_rest(self, ports: Iterable[Output], timeout_s: float = REST_TIMEOUT_S) -> dict[Output, int]:
        """Wait until motors have stopped turning; their tacho counts [deg]. Raises Timeout, and as :meth:`ask`."""
        before: dict[Output, int] = {}
        try:
            async with asyncio.timeout(timeout_s):
                while (counts := {port: (await self.output(port)).tacho_deg for port in ports}) != before:
                    before = counts
        except TimeoutError:
            raise Timeout(
                f"motors of {self.name} turn on after their move", remedy="is somebody turning them?"
            ) from None
        return counts

    # --- battery -----------------------------------------------------------------------------------------------------

    @property
    def battery_low(self) -> bool:
        """Whether the battery is below the voltage of warning."""
        return self.battery_v < self.settings.warn_v

    async def read_battery(self) -> float:
        """Voltage of the battery [V]; tells it when it has become low."""
        was_low = self.battery_low
        reply = await self._read(requests.GetBatteryLevel(), replies.BatteryLevel)
        self.battery_v = reply.voltage_mv / 1000
        if self.battery_low and not was_low:
            self._tell(f"the battery of {self.name} is low: {self.battery_v:.1f} V ({_CHARGE})")
        return self.battery_v

    def require_battery(self) -> None:
        """Raise NotReady where the battery is too low to begin a move."""
        if self.battery_v < self.settings.refuse_v:
            message = f"the battery of {self.name} has only {self.battery_v:.1f} V: no move begins"
            raise NotReady(message, value=self.battery_v, limit=self.settings.refuse_v, remedy=_CHARGE)

    # --- motors ------------------------------------------------------------------------------------------------------

    @property
    def moving(self) -> bool:
        """Whether a move is under way."""
        return not self._still.is_set()

    async def wait_still(self) -> None:
        """Return when no move is under way."""
        await self._still.wait()

    def stop(self, brake: bool = True, port: Output = Output.ALL) -> None:
        """Stop motors at once, before anything that waits; a move under way fails. Never raises.

        Args:
            brake: short them; or else let them coast.
            port: one of them, or all.
        """
        self._stops += 1
        self._loose |= set(Output) - {Output.ALL} if port == Output.ALL else {port}
        if self._line is not None:
            mode, state = (_BRAKED, RunState.RUNNING) if brake else (OutputMode.IDLE, RunState.IDLE)
            self._line.send_first(requests.SetOutputState(port, 0, mode, Regulation.IDLE, 0, state, 0))

    def release(self, port: Output) -> None:
        """Take a motor's power away; the brick goes on counting towards its next move. Raises as :meth:`run`."""
        self.require_ready()
        state = requests.SetOutputState(port, 0, OutputMode.IDLE, Regulation.IDLE, 0, RunState.IDLE, 0)
        self._connected().send(state)

    def run(self, powers: Mapping[Output, int]) -> None:
        """Let motors run at regulated speeds, for ``reach_s`` at most; call it again before that.

        Args:
            powers: 100 is 1000 degrees a second, 0 holds the motor.

        Raises:
            NodeAbsent, NotReady, BusOff: the brick is not connected.
        """
        self.require_ready()
        for port, power in powers.items():
            self._loose.add(port)
            reach = math.ceil(abs(power) / 100 * FULL_SPEED_DEG_S * self.settings.reach_s)
            self._drive(port, power, reach)

    def _drive(self, port: Output, power: int, limit_deg: int) -> None:
        line, anchor = self._connected(), port in self._loose
        limits = (0, limit_deg) if anchor and limit_deg else (limit_deg,)
        for limit in limits:
            state = requests.SetOutputState(port, power, _DRIVEN, Regulation.SPEED, 0, RunState.RUNNING, limit)
            line.send(state)

    async def move(self, legs: Legs, timeout_s: float | None = None) -> None:
        """Turn motors by angles and return when all of them are idle.

        Args:
            legs: power (its sign does not matter) and angle by motor; one of less than half a degree rests.
            timeout_s: default is twice the time that the angles take, and three seconds.

        Raises:
            NotReady: the battery is too low, or another move is under way.
            Timeout: a motor did not arrive; all are stopped.
            Refused: somebody stopped the motors.
            NodeAbsent, BusOff, ValueError: the brick is gone; a motor would turn at power 0.
        """
        self.require_ready()
        self.require_battery()
        if self.moving:
            raise NotReady(f"the motors of {self.name} are in the middle of a move", remedy="wait for it, or stop it")
        orders = {port: move_order(power, angle) for port, (power, angle) in legs.items() if round(angle)}
        if timeout_s is None:
            timeout_s = 3 + 2 * max((limit / abs(power) / 10 for power, limit in orders.values()), default=0.0)
        self._still.clear()
        try:
            async with asyncio.timeout(timeout_s):
                await self._move(orders)
        except TimeoutError:
            self.stop()
            raise self._stuck(orders, timeout_s) from None
        except asyncio.CancelledError:
            self.stop()
            raise
        finally:
            self._still.set()

    async def settle(self, ports: Iterable[Output]) -> dict[Output, int]:
        """Wait until motors rest after a move, and remember where: a wheel that is pushed from there on counts anew.

        Returns:
            Tacho counts [deg].

        Raises:
            Timeout: they turn on; and as :meth:`ask`.
        """
        counts = await self.until_rest(ports)
        self._left_at |= counts
        return counts

    async def _move(self, orders: Mapping[Output, tuple[int, int]]) -> None:
        stops = self._stops
        self._loose |= {port for port in orders if self._was_pushed(port)}
        for port, (power, limit) in orders.items():
            self._drive(port, power, limit)
            self._left_at.pop(port, None)
        while any([(await self.output(port)).run_state != RunState.IDLE for port in orders]):
            if self._stops != stops:
                raise Refused(f"the motors of {self.name} were stopped in the middle of a move")
        self._loose -= orders.keys()

    def _was_pushed(self, port: Output) -> bool:
        """Whether a motor stands elsewhere than its last move has left it; the brick would turn it back."""
        left_at = self._left_at.get(port)
        return left_at is not None and abs(self._counts[port] - left_at) > PUSHED_DEG

    def _stuck(self, ports: Iterable[Output], timeout_s: float) -> Timeout:
        names = ", ".join(port.name for port in ports)
        return Timeout(
            f"motors {names} of {self.name} did not arrive in {timeout_s:.1f} s and were stopped",
            remedy="is something in the way, is every motor plugged in, and is the battery charged?",
        )
