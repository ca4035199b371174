"""Digital outputs of one drive (objects 0x2078 and 0x2079; maxon EPOS Firmware Specification 14.1.41, 14.1.42)."""

from __future__ import annotations

from drivers.canopen.configuration import Configuration
from drivers.canopen.sdo import SdoClient
from drivers.epos.objects import OBJECTS


class OutputBits:
    """The general purpose bits of the output word that this program switches; the others stay as they are.

    Args:
        sdo: the drive's client.
    """

    def __init__(self, sdo: SdoClient) -> None:
        self._sdo = sdo
        self._resting: dict[int, bool] = {}
        self._outputs: dict[int, int] = {}
        self._word = 0

    @property
    def own_bits(self) -> int:
        """The bits that this program switches, as a mask."""
        return sum(1 << bit for bit in self._resting)

    def use(self, output: int, bit: int, resting_level: bool) -> None:
        """Take an output.

        Args:
            output: number of the digital output, 1 to 4.
            bit: bit of the output word that stands for it, 12 to 15.
            resting_level: its level after a (re)start of the drive.
        """
        self._resting[bit] = resting_level
        self._outputs[output] = bit

    async def set_up(self, configuration: Configuration) -> None:
        """Function, polarity and resting level first; then the mask, with which the drive begins to switch."""
        if not self._resting:
            return
        own = self.own_bits
        names = ("digital_output_functions_state", "digital_output_functions_mask", "digital_output_functions_polarity")
        state, mask, polarity = (OBJECTS[name] for name in names)
        resting = sum(level << bit for bit, level in self._resting.items())
        self._word = await self._sdo.read_int(state) & ~own | resting
        await configuration.write(
            [(OBJECTS[f"function_of_digital_output_{output}"], bit) for output, bit in self._outputs.items()]
        )
        await configuration.write([(polarity, await self._sdo.read_int(polarity) & ~own), (state, self._word)])
        await configuration.write([(mask, await self._sdo.read_int(mask) | own)])

    async def switch(self, bit: int, level: bool) -> None:
        """Set one bit. Raises NodeAbsent, Timeout or Aborted."""
        self._word = self._word | 1 << bit if level else self._word & ~(1 << bit)
        await self._sdo.write(OBJECTS["digital_output_functions_state"], self._word)
