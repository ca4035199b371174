"""Leaves a drive safe whose master has died: at rest, its brakes engaged, its power stage off.

By SDO alone, which a node answers in operational and in pre-operational. Life guarding stops the motor of such a drive
by itself, but an EPOS keeps its outputs, so that a brake that was released stays so.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from canhelm.errors import DeviceFault
from drivers.canopen.sdo import SdoClient
from drivers.epos.objects import OBJECTS
from drivers.epos.state_machine import Command, state_of
from drivers.epos.units import WheelUnits
from profiles.schema import BrakeConfig, DriveConfig

AT_REST_M_S = 0.01

_CONTROLWORD, _STATUSWORD = OBJECTS["controlword"], OBJECTS["statusword"]
_OUTPUTS, _OUTPUT_MASK = OBJECTS["digital_output_functions_state"], OBJECTS["digital_output_functions_mask"]


async def stop(sdo: SdoClient, config: DriveConfig, brakes: Sequence[BrakeConfig]) -> float:
    """Quick stop, steering brakes at once, holding brakes at rest; one without torque does not wait for that.

    Nothing changes where the drive stands and its brakes are engaged.

    Args:
        sdo: the drive's client.
        config: the drive.
        brakes: those on its outputs.

    Returns:
        Time that its ramp still takes [s].

    Raises:
        NodeAbsent, Timeout, Aborted: it does not answer, or refuses.
    """
    await sdo.write(_CONTROLWORD, int(Command.QUICK_STOP))
    await _engage(sdo, [brake for brake in brakes if brake.kind == "steering"])
    ramp_s = await _speed_m_s(sdo, config) / config.quick_stop_m_s2 if await _has_torque(sdo) else 0.0
    holding = [brake for brake in brakes if brake.kind == "holding"]
    if not holding:
        return ramp_s
    await asyncio.sleep(ramp_s)
    await _engage(sdo, holding)
    return 0.0


async def switch_off(sdo: SdoClient, config: DriveConfig, who: str) -> float:
    """Power off, and no guarding of a master that is not there any more.

    Args:
        sdo, config: as for :func:`stop`.
        who: the drive for people.

    Returns:
        Speed at which its wheel rolls on without torque [m/s].

    Raises:
        NodeAbsent, Timeout, Aborted: it does not answer, or refuses.
        DeviceFault: its power stage stays on.
    """
    await sdo.write(_CONTROLWORD, int(Command.DISABLE_VOLTAGE))
    if await _has_torque(sdo):
        raise DeviceFault(f"{who} does not switch off", node=sdo.node, remedy="take its motor power away")
    await sdo.write(OBJECTS["life_time_factor"], 0)
    return await _speed_m_s(sdo, config)


async def _has_torque(sdo: SdoClient) -> bool:
    state = state_of(await sdo.read_int(_STATUSWORD))
    return state is None or state.power_stage_on


async def _speed_m_s(sdo: SdoClient, config: DriveConfig) -> float:
    return abs(await sdo.read_int(OBJECTS["velocity_actual_value"]) / WheelUnits.of(config).rpm_per_m_s)


async def _engage(sdo: SdoClient, brakes: Sequence[BrakeConfig]) -> None:
    """Switch the outputs of brakes that the drive has been configured for, and wait until they have closed."""
    configured = await sdo.read_int(_OUTPUT_MASK) if brakes else 0
    ours = [brake for brake in brakes if configured >> brake.output_bit & 1]
    if not ours:
        return
    found = word = await sdo.read_int(_OUTPUTS)
    for brake in ours:
        bit = 1 << brake.output_bit
        word = word | bit if brake.energise_to_release else word & ~bit
    if word != found:
        await sdo.write(_OUTPUTS, word)
        await asyncio.sleep(max(brake.close_time_s for brake in ours))
