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
from drivers.epos.state_machine import Command, State, state_of
from drivers.epos.units import WheelUnits
from profiles.schema import BrakeConfig, DriveConfig

SETTLING_S = 0.1
"""Time that a motor is given beyond its ramp."""
AT_REST_M_S = 0.01

_CONTROLWORD, _STATUSWORD = OBJECTS["controlword"], OBJECTS["statusword"]
_OUTPUTS, _OUTPUT_MASK = OBJECTS["digital_output_functions_state"], OBJECTS["digital_output_functions_mask"]


async def make_safe(sdo: SdoClient, config: DriveConfig, brakes: Sequence[BrakeConfig], who: str) -> None:
    """Quick stop, steering brakes; at rest: holding brakes, power off. Changes nothing where all of it is so already.

    Args:
        sdo: the drive's client.
        config: the drive.
        brakes: those on its outputs.
        who: the drive for people.

    Raises:
        NodeAbsent, Timeout, Aborted: it does not answer, or refuses.
        DeviceFault: it is not safe in spite of everything.
    """
    await sdo.write(_CONTROLWORD, int(Command.QUICK_STOP))
    await _engage(sdo, [brake for brake in brakes if brake.kind == "steering"])
    speed_m_s = await _speed_m_s(sdo, config)
    if speed_m_s > AT_REST_M_S and await _state(sdo) is not State.FAULT:
        await asyncio.sleep(speed_m_s / config.quick_stop_m_s2 + SETTLING_S)
        speed_m_s = await _speed_m_s(sdo, config)
    await _engage(sdo, [brake for brake in brakes if brake.kind == "holding"])
    await sdo.write(_CONTROLWORD, int(Command.DISABLE_VOLTAGE))
    state = await _state(sdo)
    if state is None or state.power_stage_on:
        raise DeviceFault(f"{who} does not switch off", node=sdo.node, remedy="take its motor power away")
    await sdo.write(OBJECTS["life_time_factor"], 0)
    if speed_m_s > AT_REST_M_S:
        raise DeviceFault(f"{who} is off and still turns at {speed_m_s:.2f} m/s", node=sdo.node, remedy="hold it")


async def _state(sdo: SdoClient) -> State | None:
    return state_of(await sdo.read_int(_STATUSWORD))


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
