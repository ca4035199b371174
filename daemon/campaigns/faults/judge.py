"""Judges a simulated robot by the truth of its simulation: does anything move or have power that should not?

The truth is looked at two hundred times a second, by a timer of its own: a daemon that hangs is watched, too. Of the
daemon it asks only whether it has latched a stop, since that revokes what was commanded.
"""

from __future__ import annotations

import asyncio
import logging
import math
from typing import Any, Final

from daemon.app import App
from daemon.campaigns.faults.limits import SPEED_SHARE, Limits
from daemon.campaigns.faults.strikes import Reach
from daemon.runtime.vehicle import VehicleState
from drivers.contract import NodeState
from drivers.simulated.network import SimulatedNetwork

LOOK_S: Final = 0.005
LATCHED: Final = (VehicleState.FAULT, VehicleState.ESTOP)


class Judge:
    """Watches one robot; use it as a context.

    Args:
        app: the daemon and its simulated network.
        limits: to be kept.

    Attributes:
        violations: what was wrong, a sentence for each invariant, by the invariant.
        moved_s: when a wheel last turned faster than what counts as rest, settling included.
        live: whether a command may move anything now.
        reach: how drives hear of a stop, as far as is known.
        blocked: whether a wheel is held, so that the others are wound up.
        wild: whether a drive's own readings are wrong, so that it cannot keep its speed.
        deaf: brakes that cannot be told, or do not obey.
    """

    def __init__(self, app: App, limits: Limits) -> None:
        assert app.network is not None
        self.violations: dict[str, str] = {}
        self.moved_s = 0.0
        self.live = False
        self.reach: Reach = "pdo"
        self.wild = self.blocked = False
        self.deaf: frozenset[str] = frozenset()
        self._app, self._limits = app, limits
        self._network: SimulatedNetwork = app.network
        self._rims = {
            name: (axis, drive.wheel_radius_m / drive.total_ratio)
            for name, axis in self._network.world.axes.items()
            for drive in (app.profile.drives[name],)
        }
        self._encoders = tuple(app.profile.encoders)
        self._headings = dict.fromkeys(self._encoders, (0.0, 0.0))
        self._fastest_m_s = self._rest_by_s = self._off_by_s = 0.0
        self._notice_by_s = math.inf
        self._rested_m: tuple[float, ...] | None = None
        self._free_since_s: dict[str, float] = {}
        self._timer: asyncio.TimerHandle | None = None
        self._log = _Defects(self)

    def __enter__(self) -> Judge:
        self._loop = asyncio.get_running_loop()
        logging.getLogger().addHandler(self._log)
        self._loop.set_exception_handler(self._on_loop_error)
        self._look()
        return self

    def __exit__(self, *_: object) -> None:
        logging.getLogger().removeHandler(self._log)
        self._loop.set_exception_handler(None)
        if self._timer is not None:
            self._timer.cancel()

    # What is commanded

    def command(self, fastest_m_s: float, headings_rad: dict[str, float] | None = None) -> None:
        """A command begins: how fast its wheels may turn, and where its pairs may go from where they are."""
        self.live = True
        self._fastest_m_s = fastest_m_s
        world = self._network.world
        for name in self._encoders:
            here = world.heading_rad(name)
            there = (headings_rad or {}).get(name, here)
            self._headings[name] = (min(here, there), max(here, there))

    def revoke(self, slowing_m_s2: float | None = None) -> None:
        """The command is over, or must go no further; by the quick stop unless another ramp is said."""
        if self.live:
            self.live = False
            self._rest_by_s = self._off_by_s = 0.0
            self.allow(slowing_m_s2)

    def strike(self, reach: Reach, *, wild: bool, silences: bool) -> None:
        """Something breaks: a stop that is under way may take as long as if it began now."""
        self._notice_by_s = self._loop.time() + self._limits.noticed_s if silences else math.inf
        self.reach, self.wild = reach, wild
        self.allow()

    def allow(self, slowing_m_s2: float | None = None) -> None:
        """Give the time that a stop takes from now."""
        limits, now_s, speed_m_s = self._limits, self._loop.time(), self.rim_m_s()
        rest_s = limits.rest_s(speed_m_s, self.reach)
        if slowing_m_s2 is not None:
            rest_s += speed_m_s / slowing_m_s2
        if self.wild:
            rest_s += limits.overrun_s + limits.off_s
        off_s = limits.off_s if self.reach == "pdo" else limits.off_otherwise_s
        if slowing_m_s2 is not None:
            off_s += limits.settled_s
        self._rest_by_s = max(self._rest_by_s, now_s + rest_s)
        self._off_by_s = max(self._off_by_s, self._rest_by_s + off_s)
        self._rested_m = None

    def _rolled_m(self) -> tuple[float, ...]:
        """How far each rim has turned."""
        return tuple(axis.position_rad * per_shaft_m for axis, per_shaft_m in self._rims.values())

    def rim_m_s(self) -> float:
        """True speed of the fastest rim."""
        return max(abs(axis.speed_rad_s) * per_shaft_m for axis, per_shaft_m in self._rims.values())

    @property
    def quiet(self) -> bool:
        """Whether nothing moves and nothing has power."""
        return self.rim_m_s() < self._limits.at_rest_m_s and not self._powered()

    def _powered(self) -> list[str]:
        return [name for name, drive in self._network.drives.items() if drive.motion.powered]

    def violated(self, invariant: str, told: str) -> None:
        """Note a violation, the first of each invariant."""
        self.violations.setdefault(invariant, f"{told} at {self._loop.time():.3f} s")

    # What is true

    def _look(self) -> None:
        now_s = self._loop.time()
        self._network.catch_up()
        if self.live and self._app.supervisor.state in LATCHED:
            self.revoke()
        fastest_m_s = self.rim_m_s()
        if fastest_m_s >= self._limits.at_rest_m_s:
            self.moved_s = now_s
        if not self.live:
            self._check_stopped(now_s)
        elif now_s > self._notice_by_s:
            self.violated("notice", "a device says nothing, and its command is still live")
        self._check_limits(fastest_m_s)
        self._check_brakes(now_s)
        self._timer = self._loop.call_later(LOOK_S, self._look)

    def _check_stopped(self, now_s: float) -> None:
        if now_s > self._rest_by_s:
            rolled_m = self._rolled_m()
            self._rested_m = self._rested_m or rolled_m
            further_m = _farthest_m(rolled_m, self._rested_m)
            if further_m > (self._limits.wound_up_m if self.blocked else self._limits.settling_m):
                self.violated("rest", f"a wheel has gone on for {further_m * 1e3:.1f} mm without a live command")
        if now_s > self._off_by_s and (powered := self._powered()):
            self.violated("torque", f"{', '.join(powered)} has power without a live command")

    def _check_limits(self, fastest_m_s: float) -> None:
        limits = self._limits
        top_m_s = self._fastest_m_s * (1.0 + SPEED_SHARE) + limits.wrong_target_m_s
        if fastest_m_s > (limits.fastest_m_s if self.wild else top_m_s):
            self.violated("speed", f"a wheel turns at {fastest_m_s:.3f} m/s")
        for name, (low, high) in self._headings.items():
            heading = self._network.world.heading_rad(name)
            off = max(low - heading, heading - high)
            if abs(heading) > limits.heading_rad or off > limits.astray_rad:
                self.violated("heading", f"pair {name} stands at {math.degrees(heading):.1f} deg")

    def _check_brakes(self, now_s: float) -> None:
        """A brake that could be told to engage has engaged in its time, while nothing may turn its pair."""
        for name, brake in self._network.brakes.items():
            ready = self._app.devices.drives[self._app.devices.brakes[name].drive].node_state is NodeState.READY
            if brake.engaged or self.live or not ready or name in self.deaf or now_s <= self._rest_by_s:
                self._free_since_s.pop(name, None)
            elif now_s - self._free_since_s.setdefault(name, now_s) > self._limits.braked_s:
                self.violated("brake", f"brake {name} is released without a live command")

    def _on_loop_error(self, _: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        self.violated("defect", f"{context.get('message')}: {context.get('exception')!r}")


def _farthest_m(one_m: tuple[float, ...], other_m: tuple[float, ...]) -> float:
    """The largest difference."""
    return max(abs(a - b) for a, b in zip(one_m, other_m, strict=True))


class _Defects(logging.Handler):
    """A traceback in the log is a defect of the daemon."""

    def __init__(self, judge: Judge) -> None:
        super().__init__(logging.ERROR)
        self._judge = judge

    def emit(self, record: logging.LogRecord) -> None:
        if record.exc_info:
            self._judge.violated("defect", f"{record.getMessage()}: {record.exc_info[1]!r}")
