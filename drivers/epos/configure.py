"""The steps that write a profile's configuration to an EPOS 24/5, and prove it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import TypeVar

from canhelm.errors import CanhelmError, DeviceFault, Refused
from drivers.canopen.codes import NmtCommand
from drivers.canopen.configuration import Configuration
from drivers.canopen.device import Step
from drivers.canopen.master import Master
from drivers.canopen.objects import ObjectDef
from drivers.canopen.pdo import Settings
from drivers.canopen.sdo import SdoClient
from drivers.epos.codec import DRIVING_MODES
from drivers.epos.codes import EMERGENCIES
from drivers.epos.emergency_stop_input import EmergencyStopInput
from drivers.epos.objects import OBJECTS
from drivers.epos.outputs import OutputBits
from drivers.epos.parameters import guarding_plan, parameter_plan, pdo_plan, start_up_plan
from drivers.epos.state_machine import Command, state_of
from profiles.schema import DriveConfig

T = TypeVar("T")

DEVICE_TYPE = 0x0020_0192
VENDOR_MAXON = 0xFB
HARDWARE_24_5, HARDWARE_MASK = 0x6210, 0xFFF0
OLDEST_FIRMWARE = 0x2010
"""Before it the digital outputs and the RS-232 protocol were different (Firmware Specification 15.4)."""

ZERO_TARGETS: Settings = [
    (OBJECTS["target_velocity"], 0),
    (OBJECTS["velocity_mode_setting_value"], 0),
    (OBJECTS["current_mode_setting_value"], 0),
]
"""A drive keeps its last target over a restart of its master, and would follow it when it is enabled."""


class EposSetup:
    """One attempt to configure one drive, in pre-operational.

    Args:
        config: the drive in the profile.
        master: of its bus.
        sdo: the node's client.
        who: the node for people.
        outputs: its digital outputs, which carry the brakes.
        stop_input: its input with an emergency stop.
    """

    def __init__(
        self,
        config: DriveConfig,
        master: Master,
        sdo: SdoClient,
        who: str,
        outputs: OutputBits,
        stop_input: EmergencyStopInput | None,
    ) -> None:
        self._config = config
        self._master = master
        self._network = master.network
        self._sdo = sdo
        self._who = who
        self._outputs = outputs
        self._stop_input = stop_input
        self._written = Configuration(sdo, who, master.pacing)
        self._firmware = 0

    @property
    def confirmed(self) -> dict[ObjectDef, int]:
        """What the drive has been read to have, once all steps are done."""
        start_up = dict(start_up_plan(self._config))
        return {OBJECTS["software_version"]: self._firmware} | start_up | self._written.written

    def stop_step(self) -> Step:
        """Stops the drive and switches it off."""
        return Step("stopping it", self._stop)

    def steps(self) -> tuple[Step, ...]:
        """The steps in their order."""
        return (
            Step("checking its identity", self._check_identity),
            self.stop_step(),
            Step("clearing its errors", self._clear_errors),
            Step("setting up guarding", self._write_guarding),
            Step("mapping its PDOs", self._write_pdos),
            Step("writing its limits and ramps", self._write_parameters),
            Step("setting up its inputs and outputs", self._write_inputs_and_outputs),
            Step("writing zero targets", self._write_zero_targets),
            Step("setting its mode of operation", self._write_mode),
            Step("reading everything back", self._written.verify),
        )

    async def _check_identity(self) -> None:
        expect, other = self._written.expect, "check the node ids: another kind of device stands on this one"
        await expect(OBJECTS["device_type"], DEVICE_TYPE, other)
        await expect(OBJECTS["vendor_id"], VENDOR_MAXON, other)
        await expect(OBJECTS["hardware_version"], HARDWARE_24_5, other, HARDWARE_MASK)
        self._firmware = firmware = await self._sdo.read_int(OBJECTS["software_version"])
        if firmware < OLDEST_FIRMWARE:
            raise Refused(
                f"{self._who}: 0x2003/1 (software_version) is 0x{firmware:04X}, not 0x{OLDEST_FIRMWARE:04X} or later",
                node=self._sdo.node,
                object="0x2003/1",
                value=firmware,
                limit=OLDEST_FIRMWARE,
                remedy="update the drive's firmware",
            )

    async def _stop(self) -> None:
        """A drive that still turns is brought to rest by its ramp, then off; only then it needs no life guarding.

        Until it says that it is off, nothing but its life guarding stops it where it can be told no more; and one whose
        communication was reset has none. So its node is restarted where it does not do as it is told.
        """
        try:
            await self._switch_off()
        except CanhelmError:
            self._master.send_nmt(NmtCommand.RESET_NODE, self._sdo.node)
            raise
        await self._written.write(((OBJECTS["life_time_factor"], 0), (OBJECTS["guard_time"], 0)))

    async def _switch_off(self) -> None:
        if await _twice(self._is_powered):
            await _twice(lambda: self._sdo.write(OBJECTS["controlword"], Command.QUICK_STOP))
            await asyncio.sleep(self._config.max_speed_m_s / self._config.quick_stop_m_s2)
        await _twice(lambda: self._sdo.write(OBJECTS["controlword"], Command.DISABLE_VOLTAGE))
        if await _twice(self._is_powered):
            remedy = "its node is restarted, and it is tried again; if it stays so, switch its supply off and on"
            raise DeviceFault(f"{self._who} does not switch off", node=self._sdo.node, remedy=remedy)

    async def _is_powered(self) -> bool:
        """Whether its power stage is on, or it does not say so plainly."""
        state = state_of(await self._sdo.read_int(OBJECTS["statusword"]))
        return state is None or state.power_stage_on

    async def _clear_errors(self) -> None:
        await self._sdo.write(OBJECTS["controlword"], Command.FAULT_RESET)
        await self._sdo.write(OBJECTS["controlword"], Command.DISABLE_VOLTAGE)
        await self._sdo.write(OBJECTS["number_of_recorded_errors"], 0)

    async def _write_guarding(self) -> None:
        await self._written.write(guarding_plan(self._network))

    async def _write_pdos(self) -> None:
        await self._written.write(pdo_plan(self._config, synchronous=self._network.synchronous))

    async def _write_parameters(self) -> None:
        await self._written.write(parameter_plan(self._config))
        pulses = OBJECTS["encoder_pulses_per_turn"]
        if await self._sdo.read_int(pulses) != self._config.encoder_pulses_per_turn:
            await self._written.write([(pulses, self._config.encoder_pulses_per_turn)])
            await self._clear_errors()  # the change of a sensor parameter raises 0x7320
        await self._check_start_up()

    async def _check_start_up(self) -> None:
        """What counts from the drive's start on cannot be changed here; all of it that differs is told at once."""
        found = await self._written.differences(start_up_plan(self._config))
        if found:
            node = self._sdo.node
            raise Refused(
                f"{self._who}: {'; '.join(map(str, found))}",
                node=node,
                object=found[0].entry.address,
                value=found[0].found,
                limit=found[0].expected,
                remedy=f"`canhelm config apply {node} --save` writes the profile's values, keeps them and restarts it; "
                f"a replaced drive is made like the old one by `canhelm config restore DIR {node}`",
            )

    async def _write_inputs_and_outputs(self) -> None:
        if self._stop_input:
            await self._stop_input.set_up(self._sdo, self._written)
        await self._outputs.set_up(self._written)

    async def _write_zero_targets(self) -> None:
        await self._written.write(ZERO_TARGETS)

    async def _write_mode(self) -> None:
        mode = DRIVING_MODES[self._config.mode]
        await self._written.write([(OBJECTS["mode_of_operation"], mode)])
        await self._written.expect(
            OBJECTS["mode_of_operation_display"], mode, "switch the drive off and on; see 0x6502 for its modes"
        )


async def _twice(request: Callable[[], Awaitable[T]]) -> T:
    """A request's answer; it is made once more where there is none, or a refusal."""
    try:
        return await request()
    except CanhelmError:
        return await request()


def emergency_words(code: int) -> tuple[str, str]:
    """What an emergency code of the drive says, and its cure."""
    known = EMERGENCIES.get(code)
    if known is None:
        return f"emergency 0x{code:04X}", f"`canhelm explain 0x{code:04X}`"
    return f"{known.name} (0x{code:04X}): {known.meaning}", known.cure
