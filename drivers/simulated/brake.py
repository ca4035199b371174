"""An electromechanical brake on a digital output of a drive."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from profiles.schema import BrakeConfig


class SimulatedBrake:
    """Follows its coil after the brake's opening and closing times.

    Args:
        config: the brake of the profile.
        act: called with True when it has engaged, with False when it has released.

    Attributes:
        energised: current flows in the coil.
        engaged: what the brake does, after its times.
        broken: what it does whatever its coil says: True where it does not open, False where it does not hold.
    """

    def __init__(self, config: BrakeConfig, act: Callable[[bool], None]) -> None:
        self.energised = False
        self.engaged = config.energise_to_release
        self.broken: bool | None = None
        self._config = config
        self._act = act
        self._timer: asyncio.TimerHandle | None = None

    def set_coil(self, energised: bool) -> None:
        """Current begins or ceases to flow."""
        self.energised = energised
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        engage = energised is not self._config.energise_to_release
        if engage is not self.engaged and self.broken is None:
            delay_s = self._config.close_time_s if engage else self._config.open_time_s
            self._timer = asyncio.get_running_loop().call_later(delay_s, self._moved, engage)

    def wear_out(self, broken: bool | None) -> None:
        """Be broken from now on, or mended (None): then the brake does at once what its coil says."""
        self.close()
        self.broken = broken
        self._moved((self.energised is not self._config.energise_to_release) if broken is None else broken)

    def close(self) -> None:
        """Cancel a movement under way."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _moved(self, engaged: bool) -> None:
        self._timer = None
        self.engaged = engaged
        self._act(engaged)
