"""The CAN controller behind an interface, as its error frames tell: its state, its troubles, and what to do."""

from __future__ import annotations

import logging
from typing import Any

from drivers.bus.can_errors import ControllerState, controller_state, parse_error

LOGGER = logging.getLogger("canhelm.bus")

BUS_OFF_CAUSES = "check wiring, termination and bit rate"
_LEVELS = {
    ControllerState.ERROR_ACTIVE: logging.INFO,
    ControllerState.ERROR_WARNING: logging.WARNING,
    ControllerState.ERROR_PASSIVE: logging.WARNING,
    ControllerState.BUS_OFF: logging.ERROR,
}


class Controller:
    """Follows the state of one controller; a disturbed bus may bring thousands of error frames a second.

    Args:
        name: of the interface.
        restart: the line that ends bus-off.

    Attributes:
        state: as the last error frame told it that told any.
        bus_offs: how often it went bus-off.
    """

    def __init__(self, name: str, restart: str) -> None:
        self.state = ControllerState.ERROR_ACTIVE
        self.bus_offs = 0
        self._name = name
        self._restart = restart
        self._last: tuple[int, bytes] | None = None

    @property
    def bus_off(self) -> bool:
        """Whether it takes no part in the traffic."""
        return self.state is ControllerState.BUS_OFF

    def take(self, can_id: int, data: bytes) -> None:
        """Take an error frame."""
        self._last = (can_id, data)
        state = controller_state(can_id, data)
        if state is not None and state is not self.state:
            self.bus_offs += state is ControllerState.BUS_OFF
            self.state = state
            self._tell(", ".join(parse_error(can_id, data).words))

    def recovered(self) -> None:
        """It takes part in the traffic again, whatever it told last."""
        if self.bus_off:
            self.state = ControllerState.ERROR_ACTIVE
            self._tell("takes part in the traffic again")

    def remedy(self) -> str:
        """What ends bus-off."""
        return f"{BUS_OFF_CAUSES}; {self._restart}"

    def details(self) -> dict[str, Any]:
        """What there is to tell for ``status``: nothing of a controller that never had trouble."""
        if self._last is None:
            return {}
        report = parse_error(*self._last)
        told = {"controller": self.state.value, "bus_offs": self.bus_offs, "last_error": ", ".join(report.words)}
        if report.counters is not None:
            told["transmit_errors"], told["receive_errors"] = report.counters
        return told

    def _tell(self, words: str) -> None:
        if self.bus_off:
            LOGGER.error("%s is bus-off: %s (%s)", self._name, words, self.remedy())
        else:
            LOGGER.log(_LEVELS[self.state], "%s is %s: %s", self._name, self.state.value, words)
