"""What a drive carries out itself: profile position, homing, current (maxon EPOS Firmware Specification 9.2 to 9.7).

RPDO1 goes on meanwhile: its target speed is zero and has no meaning in these modes, its controlword carries their bits.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from canhelm.errors import LimitExceeded, Refused
from drivers.epos.device_control import Commander
from drivers.epos.objects import OBJECTS
from drivers.epos.state_machine import HMM_START, PPM_ABSOLUTE_AT_ONCE, PPM_RELATIVE_AT_ONCE, Command, Mode

if TYPE_CHECKING:
    from drivers.epos.drive import EposDrive

TARGET_REACHED = 1 << 10
MODE_BIT = 1 << 12
"""Set-point acknowledged in profile position, homing attained in homing."""
AT_REST_M_S = 0.02


def at_target(mode: Mode, statusword: int) -> bool:
    """Whether a statusword says that the move of a mode is done."""
    wanted = TARGET_REACHED | MODE_BIT if mode is Mode.HOMING else TARGET_REACHED
    return statusword & wanted == wanted


def _require_rest(drive: EposDrive) -> None:
    drive.require_enabled()
    if abs(drive.speed_m_s) > AT_REST_M_S:
        raise Refused(f"{drive.who} still turns", node=drive.node, limit=AT_REST_M_S, remedy="stop it first")


async def move_to(drive: EposDrive, position_qc: int, relative: bool, speed_rpm: float, command: Commander) -> None:
    """Start a profile position move and return when the drive has acknowledged the set-point.

    Args:
        position_qc: target at the motor, absolute or relative to the present position.
        speed_rpm: motor speed on the way, at most what the profile's top speed makes.
        command: sends a controlword, unless a stop came in between.

    Raises:
        NotReady: not enabled.
        Refused: it still turns, or a stop came in between.
        LimitExceeded: the speed is zero, negative or above the limit, or the position does not fit 32 bits.
        DeviceFault, Timeout, Aborted, NodeAbsent: the drive did not take it.
    """
    _require_rest(drive)
    _check_move(drive, position_qc, speed_rpm)
    await drive.enter_mode(Mode.PROFILE_POSITION)
    await drive.write((OBJECTS["profile_velocity"], round(speed_rpm)), (OBJECTS["target_position"], position_qc))
    command(PPM_RELATIVE_AT_ONCE if relative else PPM_ABSOLUTE_AT_ONCE)
    await drive.waiters.reach(lambda statusword: bool(statusword & MODE_BIT), "set-point acknowledged (bit 12)")
    command(Command.ENABLE_OPERATION)
    await drive.waiters.reach(lambda statusword: not statusword & MODE_BIT, "bit 12 clear again")


def _check_move(drive: EposDrive, position_qc: int, speed_rpm: float) -> None:
    top_rpm = abs(drive.rpm_from_speed(drive.config.max_speed_m_s))
    if not 1.0 <= speed_rpm <= top_rpm:
        raise LimitExceeded(
            f"a move at {speed_rpm:g} rpm is outside 1 to {top_rpm:.0f} rpm of {drive.who}",
            node=drive.node,
            value=speed_rpm,
            limit=round(top_rpm),
            remedy="choose a speed within that range",
        )
    if not -(2**31) <= position_qc < 2**31:
        raise LimitExceeded(
            f"position {position_qc} qc does not fit 32 bits", node=drive.node, value=position_qc, limit=2**31 - 1
        )


async def home(drive: EposDrive, method: int, command: Commander) -> None:
    """Start homing and return when the drive has taken the start; errors as :func:`move_to`.

    Args:
        method: number of the method (object 0x6098).
        command: sends a controlword, unless a stop came in between.
    """
    _require_rest(drive)
    await drive.write((OBJECTS["homing_method"], method))
    await drive.enter_mode(Mode.HOMING)
    command(HMM_START)
    readings = iter((False, False, True))
    await drive.waiters.reach(lambda _: next(readings), "the start of homing")


async def set_current(drive: EposDrive, current_a: float) -> None:
    """Switch to current mode if needed, with a zero set value first, then set the current.

    Args:
        current_a: current with its sign at the motor.

    Raises:
        NotReady: not enabled.
        LimitExceeded: above the continuous current of the profile.
        Refused: a stop came in between.
        DeviceFault, Aborted, NodeAbsent: the drive did not take it.
    """
    drive.require_enabled()
    limit_a = drive.config.continuous_current_a
    if not abs(current_a) <= limit_a:
        raise LimitExceeded(
            f"a current of {current_a:g} A is above the {limit_a:g} A that {drive.who} may carry continuously",
            node=drive.node,
            value=current_a,
            limit=limit_a,
            remedy="choose a smaller current",
        )
    if drive.mode is not Mode.CURRENT:
        await drive.enter_mode(Mode.CURRENT)
    drive.turns.require_unstopped()
    await drive.write((OBJECTS["current_mode_setting_value"], round(1e3 * current_a)))
