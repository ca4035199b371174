"""What the fault campaign drives: a boot, a steering manoeuvre, a drive and a stop, a fault, and the way back.

One course is one robot on virtual time. Where a fault strikes it, the manoeuvre under way is the last one: what a
client is told is kept, what was broken is mended, the documented action gets the robot going, and it drives again.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from typing import Any, Final, Protocol

from canhelm.errors import CanhelmError, Refused
from daemon.campaigns.faults.judge import LATCHED, Judge
from daemon.campaigns.faults.limits import limits_of
from daemon.campaigns.faults.outcome import MANOEUVRES, Outcome
from daemon.campaigns.faults.strikes import STRIKES, Injection, fault_of, names_of, part_of
from daemon.demo_robot import DemoRobot
from daemon.runtime.vehicle import VehicleState
from drivers.contract import NodeState
from drivers.simulated.bus import SimulatedPort
from drivers.simulated.device_faults import Site
from drivers.simulated.faults import Faults
from profiles.loader import load

ROBOT: Final = "max2d"
STEERED_DEG: Final = 4.0
STEERED: Final = {"rear_deg": 0.0, "front_deg": STEERED_DEG}
SPEED_M_S: Final = 0.3
DRIVEN_S: Final = 0.3
BEFORE_STOP_S: Final = 0.45
"""The stop is commanded at full speed."""
AGAIN_M_S, AGAIN_S, AGAIN_M = 0.1, 0.1, 0.005
"""How the robot drives once more, and the way that it has gone then at least."""
PATIENCE_S: Final = 1.0
"""Time after which somebody looks at a boot that a fault keeps from its end."""
LASTS_S: Final = 0.5
"""Time before somebody mends what broke, at least; drives miss a dead master in 0.3 s."""
MENDED_S: Final = 0.3
"""Time until a person looks again: frames that were late have come, and requests that nobody answered have ended."""
ANSWER_S: Final = 10.0
LOOK_S: Final = 0.01
HEADING_OFF_RAD: Final = math.radians(0.5)
WAY_OFF_M: Final = 0.02
"""How far a manoeuvre that is told to be done may be from its end: slip, settling and rounding."""
BUS_WORDS: Final = ("no node answers", "vcan0")
"""How the daemon names what concerns the whole bus."""
BABBLING: Final = "babbling"
COMMANDED: Final = ("stop", "estop", "client_gone")


class Points(Protocol):
    """Who is told of every point of a course, and decides what strikes there."""

    def frame(self, index: int, manoeuvre: str, can_id: int, length: int) -> Injection | None:
        """A frame has been on the bus, and arrives unless it is struck now."""

    def cycle(self, index: int, manoeuvre: str) -> Injection | None:
        """A control cycle has ended."""

    def done(self, outcome: Outcome) -> None:
        """What has struck has been judged."""


class Course:
    """One robot on its course; to be run on virtual time.

    Args:
        seed: of the simulated network.
        points: decides what strikes, and where.

    Attributes:
        outcome: of the injection; None as long as nothing has struck.
        judge: of the course.
        events: the daemon's.
    """

    def __init__(self, seed: int, points: Points) -> None:
        self._robot = DemoRobot(load(ROBOT).profile, seed, None, lambda _: None)
        self._app = app = self._robot.app
        self._service, self._supervisor = app.service, app.supervisor
        assert app.network is not None
        assert app.medium is not None
        self._network, self._medium = app.network, app.medium
        self._limits = limits_of(app.profile)
        self.judge = Judge(app, self._limits)
        self.events = self._supervisor.log.events
        self.outcome: Outcome | None = None
        self._points, self._seed = points, seed
        self._faults: Faults | None = None
        self._manoeuvre = MANOEUVRES[0]
        self._frames = self._cycles = 0
        self._lease = ""
        self._error: CanhelmError | None = None
        self._tasks: set[asyncio.Task[None]] = set()

    async def run(self) -> None:
        """Drive the course to its end, or to that of what a fault has made of it."""
        self._loop = asyncio.get_running_loop()
        self._medium.faults = self._on_frame
        self._supervisor.observers.append(self._on_cycle)
        with self.judge:
            await self._app.start()
            try:
                await self._drive_all()
            finally:
                await self._app.close()

    async def _drive_all(self) -> None:
        await self._until(lambda: self._is_ready() or self._is_stuck(), ANSWER_S)
        async with self._robot.lease("campaign") as self._lease:
            for name, drive in zip(MANOEUVRES[1:], (self._steer, self._drive, self._stop), strict=True):
                if self.outcome is not None:
                    break
                self._manoeuvre = name
                await drive()
        self._manoeuvre = ""
        if self.outcome is not None:
            async with self._robot.lease("campaign") as self._lease:
                await self._recover(self.outcome)
                self._points.done(self.outcome)

    # Manoeuvres

    async def _steer(self) -> None:
        target = math.radians(STEERED_DEG)
        await self._command("steer", {"pair": "front", "angle_deg": STEERED_DEG}, self._limits.steering_m_s, target)
        if self._is_to_be_true():
            off_rad = abs(self._network.world.heading_rad("front") - target)
            if off_rad > HEADING_OFF_RAD:
                self.judge.violated("answer", f"steered, and {math.degrees(off_rad):.2f} deg off")

    async def _drive(self) -> None:
        begin = self._place()
        await self._command("drive.turn", {**STEERED, "speed_m_s": SPEED_M_S, "duration_s": DRIVEN_S}, SPEED_M_S)
        way_m = math.dist(begin, self._place())
        if self._is_to_be_true() and abs(way_m - SPEED_M_S * DRIVEN_S) > WAY_OFF_M:
            self.judge.violated("answer", f"driven, and {way_m:.3f} m far")

    async def _stop(self) -> None:
        params = {**STEERED, "speed_m_s": SPEED_M_S, "duration_s": ANSWER_S}
        driving = self._loop.create_task(self._command("drive.turn", params, SPEED_M_S))
        await asyncio.sleep(BEFORE_STOP_S)
        self.judge.revoke()
        await self._call("stop", {})
        await driving
        if isinstance(self._error, Refused):
            self._error = None  # the motion was stopped, as it was meant to be

    async def _command(
        self, method: str, params: dict[str, Any], fastest_m_s: float, front_rad: float | None = None
    ) -> None:
        """One command that may move something until it is answered."""
        self.judge.command(fastest_m_s, {} if front_rad is None else {"front": front_rad})
        await self._call(method, params)
        self.judge.revoke()

    async def _call(self, method: str, params: dict[str, Any]) -> None:
        """One method; an error is kept, unless one was before."""
        try:
            async with asyncio.timeout(ANSWER_S + 1.0):
                await self._service.call(method, params, self._lease)
        except CanhelmError as error:
            self._error = self._error or error
        except TimeoutError:
            self.judge.violated("answer", f"{method} was not answered")

    def _place(self) -> tuple[float, float]:
        self._network.catch_up()
        return self._network.world.pose[:2]

    def _is_to_be_true(self) -> bool:
        """Whether an answer was given that says done, and nothing has struck that makes it mistaken."""
        lies = self.outcome is not None and STRIKES[self.outcome.strike].lies
        return self._error is None and not lies and self._supervisor.state not in LATCHED

    async def _until(self, condition: Callable[[], bool], at_most_s: float) -> bool:
        """Wait; whether the condition came."""
        for _ in range(round(at_most_s / LOOK_S)):
            if condition():
                return True
            await asyncio.sleep(LOOK_S)
        return condition()

    def _is_ready(self) -> bool:
        return self._supervisor.state is VehicleState.IDLE

    def _is_stuck(self) -> bool:
        return self.outcome is not None and self._loop.time() > self.outcome.at_s + PATIENCE_S

    # Points, and what strikes there

    def _on_frame(self, can_id: int, data: bytes, sender: SimulatedPort, end_s: float) -> bool:
        """A frame on the bus: whether it arrives as it is."""
        self._frames += 1
        if not self._manoeuvre:
            return True
        injection = self._points.frame(self._frames, self._manoeuvre, can_id, len(data))
        if injection is None:
            return True
        self._strike(injection, can_id)
        take = self._medium.faults
        return take is None or take(can_id, data, sender, end_s)

    def _on_cycle(self) -> None:
        if self.outcome is None and self._manoeuvre:
            self._cycles += 1
            injection = self._points.cycle(self._cycles, self._manoeuvre)
            if injection is not None:
                self._strike(injection, None)

    def _strike(self, injection: Injection, can_id: int | None) -> None:
        """From now on this is the course of one injection."""
        self._medium.faults = None
        part = part_of(injection, self._app.profile, self._seed, can_id)
        self.outcome = Outcome(injection.strike, injection.index, self._manoeuvre, part, self._loop.time())
        strike, judge = STRIKES[injection.strike], self.judge
        wild = strike.kind.startswith("encoder_") and part in self._app.profile.drives
        judge.blocked = strike.kind == "motor_blocked"
        judge.strike(strike.reach, wild=wild, silences=strike.silences)
        cut_off = part is None and strike.reach == "life"
        brakes = self._app.profile.brakes.items()
        judge.deaf = frozenset(name for name, brake in brakes if cut_off or part in (name, brake.drive))
        fault = fault_of(injection, part)
        if fault is None:
            self._interfere(injection.strike)
            return
        port = self._app.bus
        assert isinstance(port, SimulatedPort)
        self._faults = Faults(Site(self._network, self._medium, port), injection.index)
        self._faults.add(fault)
        if fault.kind in ("bus_off", "unplugged"):
            judge.revoke()

    def _interfere(self, name: str) -> None:
        """What no fault of the network is."""
        if name in ("stop", "estop"):
            self.judge.revoke()
            self.judge.allow()
            task = self._loop.create_task(self._call(name, {}))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
        elif name == "client_gone":
            self.judge.revoke(self._limits.slowing_m_s2)
            self._service.close_lease(self._lease)
        else:
            self.judge.revoke()
            self._app.cycle.stop()
            self._loop.call_later(LASTS_S, self._app.cycle.start)

    # Back

    async def _recover(self, outcome: Outcome) -> None:
        """Mend what is broken, do what the documentation says, drive again; and judge all of it."""
        lasts = STRIKES[outcome.strike].where == "cycle"
        if lasts:
            await asyncio.sleep(max(0.0, outcome.at_s + LASTS_S - self._loop.time()))
        await asyncio.gather(*self._tasks)
        await self._until(lambda: self.judge.quiet, ANSWER_S)
        self._take_down(outcome)
        if self._faults is not None:
            self._faults.clear()
        if lasts:
            await asyncio.sleep(MENDED_S)
        self.judge.deaf = frozenset()
        self.judge.strike("pdo", wild=False, silences=False)
        if not await self._until(self._all_ready, self._limits.ready_s):
            self.judge.violated("recovery", f"not ready again: {self._supervisor.message}")
        action = await self._reset() if self._supervisor.state in LATCHED else "nothing"
        if await self._drives_again():
            outcome.recovered = action
        outcome.violations = self.judge.violations

    def _take_down(self, outcome: Outcome) -> None:
        """What the robot has come to, and what is told of it."""
        state, error = self._supervisor.state, self._error
        outcome.stopped = error is not None or state in LATCHED
        outcome.told = error.message if error else self._supervisor.message
        if outcome.stopped and self.judge.moved_s > outcome.at_s:
            outcome.rest_s = round(self.judge.moved_s - outcome.at_s, 3)
        well = error is None and state is VehicleState.IDLE
        if not well and not self._is_named(outcome, error):
            self.judge.violated("message", f"state {state}, and told is {outcome.told!r}")

    def _is_named(self, outcome: Outcome, error: CanhelmError | None) -> bool:
        """Whether what is told names the device that was struck, or the bus, and says what to do.

        What a person commanded names itself; nobody can tell whose frames they are that fill a bus.
        """
        if outcome.strike in COMMANDED:
            return bool(outcome.told)
        names = () if outcome.strike == BABBLING else names_of(outcome.part, self._app.profile)
        named = not names or any(word in outcome.told for word in (*names, *BUS_WORDS))
        return bool(outcome.told) and named and (error is None or bool(error.remedy))

    def _all_ready(self) -> bool:
        return all(device.node_state is NodeState.READY for device in self._app.devices.all)

    async def _reset(self) -> str:
        try:
            await self._service.call("reset", {}, self._lease)
        except CanhelmError as error:
            self.judge.violated("recovery", f"reset is refused: {error.message}")
            return ""
        return "reset"

    async def _drives_again(self) -> bool:
        """A short way with the pairs where they stand."""
        self._error = None
        begin = self._place()
        headings = {
            f"{name}_deg": math.degrees(encoder.heading_rad) for name, encoder in self._app.devices.encoders.items()
        }
        params = {**headings, "speed_m_s": AGAIN_M_S, "duration_s": AGAIN_S}
        await self._command("drive.turn", params, self._limits.steering_m_s)
        way_m = math.dist(begin, self._place())
        if self._error is not None or way_m < AGAIN_M:
            told = self._error.message if self._error else "no error"
            self.judge.violated("recovery", f"it does not drive again ({way_m:.3f} m): {told}")
            return False
        return True
