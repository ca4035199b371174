"""An emergency stop contact at a digital input of an EPOS 24/5 (objects 0x2070 and 0x2071, told in TPDO2)."""

from __future__ import annotations

from drivers.canopen.configuration import Configuration
from drivers.canopen.sdo import SdoClient
from drivers.epos.objects import OBJECTS
from profiles.schema import EmergencyStopConfig

STALE_S = 0.5
"""An input whose level is this much older than the drive's other readings is not told any more."""
_MASK, _POLARITY, _EXECUTION = (
    OBJECTS[f"digital_input_functions_{name}"] for name in ("mask", "polarity", "execution_mask")
)


def general_purpose_bit(number: int) -> int:
    """The bit of 0x2071 for general use by an input: 15 (A) for input 1, one less for each further one.

    maxon EPOS Firmware Specification 14.1.38.
    """
    return 16 - number


class EmergencyStopInput:
    """What the contact says; the drive itself does not act on it.

    Args:
        config: the input and the level that means pressed.
        who: the drive for people.
    """

    def __init__(self, config: EmergencyStopConfig, who: str) -> None:
        self._config = config
        self._where = f"at {who}, digital input {config.input}"
        self._bit = 1 << general_purpose_bit(config.input)
        self._pressed = False
        self._time_s = 0.0

    async def set_up(self, sdo: SdoClient, configuration: Configuration) -> None:
        """Give the input its bit and its polarity, so that 1 means pressed; the other inputs stay as they are."""
        number, bit = self._config.input, self._bit
        inverted = bit if self._config.pressed == "low" else 0
        polarity = await sdo.read_int(_POLARITY) & ~bit | inverted
        await configuration.write(
            [
                (OBJECTS[f"function_of_digital_input_{number}"], general_purpose_bit(number)),
                (_POLARITY, polarity),
                (_MASK, await sdo.read_int(_MASK) | bit),
                (_EXECUTION, await sdo.read_int(_EXECUTION) & ~bit),
            ]
        )

    def begin_anew(self, now_s: float) -> None:
        """The drive has just been started: what it told before counts no more."""
        self._pressed, self._time_s = False, now_s

    def take(self, state: int, time_s: float) -> None:
        """The state of the input functions (0x2071/1) at a loop time."""
        self._pressed, self._time_s = bool(state & self._bit), time_s

    def reason(self, reading_s: float) -> str:
        """Why the vehicle must not move, or nothing.

        Args:
            reading_s: loop time of the drive's last reading.
        """
        if self._pressed:
            return f"the emergency stop {self._where}, is pressed"
        if reading_s - self._time_s > STALE_S:
            return f"the emergency stop {self._where}, is not told any more"
        return ""
