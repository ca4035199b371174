"""A simulated laser scanner: bearings to reflectors, with noise, delay and things that stand in the way."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from math import atan2, hypot, pi, radians, tau
from random import Random

from profiles.localisation import SimulatedScannerConfig

Bearing = tuple[float, str | None]
"""Bearing [rad], counter-clockwise from the scanner's direction 0, and the reflector's name where it tells it."""


class _Reflector:
    """One reflector, and until when it can or cannot be seen."""

    __slots__ = ("changes_s", "hidden", "x_m", "y_m")

    def __init__(self, x_m: float, y_m: float) -> None:
        self.x_m, self.y_m = x_m, y_m
        self.hidden = True
        self.changes_s = 0.0


class SimulatedScanner:
    """The scanner.

    Args:
        config: what it can do.
        reflectors: their places by name.
        look: brings the world up to a time and tells the scanner's true pose (x_m, y_m, heading_rad).
        seed: of noise and of what stands in the way.

    Attributes:
        on_scan: called with each scan and its age [s].
    """

    def __init__(
        self,
        config: SimulatedScannerConfig,
        reflectors: Mapping[str, tuple[float, float]],
        look: Callable[[float], tuple[float, float, float]],
        seed: str,
    ) -> None:
        self._config, self._look, self._random = config, look, Random(seed)
        self._reflectors = {name: _Reflector(*place) for name, place in reflectors.items()}
        self.on_scan: Callable[[list[Bearing], float], object] = _nobody_listens
        self._timers: list[asyncio.TimerHandle] = []
        self._due_s = 0.0

    def start(self) -> None:
        """Scan from now on."""
        self._due_s = asyncio.get_running_loop().time()
        self._arm()

    def close(self) -> None:
        """Scan no more."""
        for timer in self._timers:
            timer.cancel()

    def _arm(self) -> None:
        loop = asyncio.get_running_loop()
        self._due_s += 1.0 / self._config.rate_hz
        self._timers = [timer for timer in self._timers if timer.when() > loop.time()]
        self._timers.append(loop.call_at(self._due_s, self._run))

    def _run(self) -> None:
        now_s = self._due_s
        self._arm()
        scan, delay_s = self.scan(now_s), self._config.delay_ms / 1e3
        loop = asyncio.get_running_loop()
        self._timers.append(loop.call_at(now_s + delay_s, lambda: self.on_scan(scan, loop.time() - now_s)))

    def scan(self, now_s: float) -> list[Bearing]:
        """What it sees at a time."""
        x, y, heading = self._look(now_s)
        seen: list[Bearing] = []
        for name, reflector in self._reflectors.items():
            dx, dy = reflector.x_m - x, reflector.y_m - y
            if self._is_hidden(reflector, now_s) or hypot(dx, dy) > self._config.range_m:
                continue
            angle = atan2(dy, dx) - heading + radians(self._random.gauss(0.0, self._config.noise_deg))
            seen.append(((angle + pi) % tau - pi, name if self._config.named else None))
        return seen

    def _is_hidden(self, reflector: _Reflector, now_s: float) -> bool:
        """Whether something stands before a reflector; it comes and goes at random times."""
        share, hidden_s = self._config.hidden_share, self._config.hidden_s
        if not share:
            return False
        while reflector.changes_s <= now_s:
            reflector.hidden = not reflector.hidden
            mean_s = hidden_s if reflector.hidden else hidden_s * (1 - share) / share
            reflector.changes_s += self._random.expovariate(1 / mean_s)
        return reflector.hidden


def _nobody_listens(_: list[Bearing], __: float) -> None:
    pass
