"""Digital inputs and outputs of the simulated EPOS 24/5 (maxon EPOS Firmware Specification 14.1.38 to 14.1.42)."""

from __future__ import annotations

from collections.abc import Callable

from drivers.simulated.dictionary import SimulatedDictionary

INPUTS = range(1, 7)
OUTPUTS = range(1, 5)
NEGATIVE_LIMIT, POSITIVE_LIMIT, POSITION_MARKER = 0, 1, 3
_BOTH_EDGES, _RISING = 0, 1


class DigitalOutputs:
    """Open-drain outputs: function, state, polarity and mask make each sink current or not.

    A state bit of 1 (polarity 0) leaves the pin high: no current in a coil. An output that the mask leaves out, or of a
    drive without power, does not sink either.

    Args:
        dictionary: the drive's objects.
        ready: whether the drive is without fault.
    """

    def __init__(self, dictionary: SimulatedDictionary, ready: Callable[[], bool]) -> None:
        self._dictionary = dictionary
        self._ready = ready
        self._powered = False
        self._listeners: dict[int, Callable[[bool], None]] = {}
        self._sinking = dict.fromkeys(OUTPUTS, False)
        for name in ("state", "mask", "polarity"):
            dictionary.actions[dictionary.address(f"digital_output_functions_{name}")] = self._update
        for number in OUTPUTS:
            dictionary.actions[0x2079, number] = self._update

    def connect(self, number: int, listener: Callable[[bool], None]) -> None:
        """Tell ``listener`` whenever output ``number`` begins (True) or ceases to sink current."""
        self._listeners[number] = listener

    def switch(self, *, powered: bool) -> None:
        """The drive has booted, or lost power."""
        self._powered = powered
        self._update(0)

    def refresh(self) -> None:
        """The drive's readiness may have changed."""
        self._update(0)

    def sinking(self, number: int) -> bool:
        """Whether an output sinks current."""
        return self._sinking[number]

    def _update(self, _: int) -> None:
        number_of = self._dictionary.number
        state = number_of("digital_output_functions_state") & ~1 | self._ready()
        levels = state ^ number_of("digital_output_functions_polarity")
        sinking = number_of("digital_output_functions_mask") & ~levels if self._powered else 0
        for number in OUTPUTS:
            sinks = bool(sinking >> number_of(f"function_of_digital_output_{number}") & 1)
            if sinks is not self._sinking[number]:
                self._sinking[number] = sinks
                if number in self._listeners:
                    self._listeners[number](sinks)


class DigitalInputs:
    """Inputs with a function each; the functions' states are masked and may be inverted.

    Args:
        dictionary: the drive's objects.
        executed: called with the function code when an executed function becomes active.
        capture: called when the position marker sees the edge it waits for.
    """

    def __init__(
        self, dictionary: SimulatedDictionary, executed: Callable[[int], None], capture: Callable[[], None]
    ) -> None:
        self._dictionary = dictionary
        self._executed = executed
        self._capture = capture
        self._levels = dict.fromkeys(INPUTS, False)
        self._state = 0
        dictionary.readers[dictionary.address("digital_input_functions_state")] = self.state
        for name in ("mask", "polarity"):
            dictionary.actions[dictionary.address(f"digital_input_functions_{name}")] = self._update
        for number in INPUTS:
            dictionary.actions[0x2070, number] = self._update

    def set(self, number: int, level: bool) -> None:
        """Apply a level to input ``number``."""
        self._levels[number] = level
        self._update(0)

    def state(self) -> int:
        """Active functions, one bit each, after polarity and mask (object 0x2071/1)."""
        number_of, levels = self._dictionary.number, 0
        for number in INPUTS:
            levels |= self._levels[number] << number_of(f"function_of_digital_input_{number}")
        inverted = number_of("digital_input_functions_polarity")
        return (levels ^ inverted) & number_of("digital_input_functions_mask")

    def restart(self) -> None:
        """Take the present state without acting on it (power-up)."""
        self._state = self.state()

    def _update(self, _: int) -> None:
        before, self._state = self._state, self.state()
        changed = before ^ self._state
        acting = changed & self._dictionary.number("digital_input_functions_execution_mask")
        for function in (NEGATIVE_LIMIT, POSITIVE_LIMIT):
            if acting & self._state & 1 << function:
                self._executed(function)
        if acting & 1 << POSITION_MARKER and self._wanted_edge():
            self._capture()

    def _wanted_edge(self) -> bool:
        wanted = self._dictionary.number("capture_edge")
        rose = bool(self._state & 1 << POSITION_MARKER)
        return wanted == _BOTH_EDGES or (wanted == _RISING) is rose
