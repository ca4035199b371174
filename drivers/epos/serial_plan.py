"""How fast a vehicle can be run over the RS-232 gateway of one EPOS: time of each exchange, control rate, limits.

Byte counts are those of the first-generation protocol (maxon EPOS Communication Guide 6.2, 6.3) with its acknowledge
bytes in both directions; a byte takes ten bits on the line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import msgspec

from profiles.schema import Limits, PairedSteerGeometry, Profile

READ_BYTES = 24
"""ReadObject: 10 from the host, 14 from the drive, acknowledges included."""
WRITE_BYTES = 24
SEND_FRAME_BYTES = 18
"""SendCANFrame has no answer frame."""
REQUEST_FRAME_BYTES = 20
"""RequestCANFrame without the data bytes of its answer."""
BITS_PER_BYTE = 10

ANSWERING_S = 0.001
"""Time that an EPOS takes to answer; assumed."""
FORWARDING_S = 0.0005
"""What a forwarded request takes on the CAN side at 1 Mbit/s, the other node's time included; assumed."""
HOST_S = 0.0003
"""What the host's process takes between two bytes that wait for each other, summed over one exchange; assumed."""
SPARE = 1.15
"""Share of the line left for guarding, SDO of people, and repetitions."""
HEADING_TOLERANCE_DEG = 0.5
"""A pair that turns at the slower rate is not stopped more exactly than this."""
PATIENCE_S = 0.6
"""A little more than a gateway waits for a node that is dead (assumed)."""
LIFE_TIME_FACTOR = 2
"""A broken conversation costs the line half a second; a vehicle that moves is then stopped anyway."""
LATE_AFTER_CYCLES = 3.0
"""A line may be slower than planned."""
COASTING_S = 0.5
COASTING_M = 0.02
"""A drive switches off when its ramp ends; a vehicle that lags behind it swings to rest in this time and way, as seen
in the simulation."""
REACTION_CYCLES_CAN = 2
REACTION_CYCLES_SERIAL = 3
"""Cycles from something that happens to the wheels' answer: read, decide, written behind others."""


@dataclass(frozen=True, slots=True)
class SerialPlan:
    """What one control cycle costs on the line.

    Attributes:
        baud: bit/s of the line.
        cycle_s: time of one control cycle, spare included.
        exchanges: requests in one cycle.
        guard_time_s: time between two guard requests to a node.
    """

    baud: int
    cycle_s: float
    exchanges: int
    guard_time_s: float

    @property
    def cycle_hz(self) -> float:
        """Achievable control cycles per second."""
        return 1.0 / self.cycle_s


def exchange_s(line_bytes: int, baud: int, *, forwarded: bool) -> float:
    """Time of one exchange [s]: bytes on the line, the drive's own time, the way over CAN, the host's own time."""
    on_the_way = FORWARDING_S if forwarded else 0.0
    return line_bytes * BITS_PER_BYTE / baud + ANSWERING_S + on_the_way + HOST_S


def plan(profile: Profile, baud: int) -> SerialPlan:
    """The control cycle of a profile over a line.

    Each cycle reads the gateway drive by two objects and every other drive by one remote frame of eight bytes, reads
    every encoder and every input with an emergency stop, writes four objects of the gateway drive and one frame to each
    other drive. Each node but the gateway is guarded once in :attr:`SerialPlan.guard_time_s`.
    """
    others, encoders = len(profile.drives) - 1, len(profile.encoders)
    gateway_s = 2 * exchange_s(READ_BYTES, baud, forwarded=False) + 4 * exchange_s(WRITE_BYTES, baud, forwarded=False)
    drive_s = exchange_s(REQUEST_FRAME_BYTES + 8, baud, forwarded=True)
    drive_s += exchange_s(SEND_FRAME_BYTES, baud, forwarded=True)
    inputs = sum(drive.emergency_stop is not None for drive in profile.drives.values())
    object_s = exchange_s(READ_BYTES, baud, forwarded=True)
    cycle_s = SPARE * (gateway_s + others * drive_s + (encoders + inputs) * object_s)
    guarded = others + encoders
    guard_s = guarded * exchange_s(REQUEST_FRAME_BYTES + 1, baud, forwarded=True)
    guard_time_s = math.ceil(10 * max(4 * cycle_s, 10 * guard_s)) / 10
    cycle_s += guard_s * cycle_s / guard_time_s
    return SerialPlan(baud, cycle_s, 6 + 2 * others + encoders + inputs, guard_time_s)


def serial_speed_m_s(speed_m_s: float, deceleration_m_s2: float, can_cycle_s: float, serial_cycle_s: float) -> float:
    """The speed at which a vehicle with slower sensing comes to rest within the same way as at full speed over CAN.

    The way from an event to rest is v t + v^2 / (2 a) with t the reaction time, so the permitted speed v' solves
    v' t' + v'^2 / (2 a) = v t + v^2 / (2 a).

    Args:
        speed_m_s: limit over CAN.
        deceleration_m_s2: of the stop.
        can_cycle_s, serial_cycle_s: control cycles; the reaction takes two of the former, three of the latter.
    """
    way = speed_m_s * REACTION_CYCLES_CAN * can_cycle_s + speed_m_s**2 / (2 * deceleration_m_s2)
    reaction = REACTION_CYCLES_SERIAL * serial_cycle_s * deceleration_m_s2
    return min(speed_m_s, math.sqrt(reaction**2 + 2 * deceleration_m_s2 * way) - reaction)


def gateway_of(profile: Profile) -> str:
    """Name of the drive that the serial line is plugged into."""
    return profile.network.gateway or next(iter(profile.drives))


def serial_profile(profile: Profile, baud: int) -> Profile:
    """The profile as it can be run over the serial line of one of its drives.

    Rate, guarding and time-outs are those of the line; the vehicle's limits shrink with the rate; the drive on the line
    gets targets that expire by themselves. There is no time for an accelerometer.
    """
    line, network, gateway = plan(profile, baud), profile.network, gateway_of(profile)
    replace = msgspec.structs.replace
    deceleration = min(drive.quick_stop_m_s2 for drive in profile.drives.values())
    return replace(
        profile,
        accelerometer=None,
        network=replace(
            network,
            cycle_hz=round(line.cycle_hz, 3),
            guard_time_ms=max(network.guard_time_ms, round(1e3 * line.guard_time_s)),
            life_time_factor=LIFE_TIME_FACTOR,
            patience_s=PATIENCE_S,
            boot_deadline_s=30.0,
            sdo_timeout_s=2.5,
            late_after_cycles=LATE_AFTER_CYCLES,
            synchronous=False,
            gateway=gateway,
        ),
        drives={
            name: replace(drive, analog_inputs=False, mode="expiring_position" if name == gateway else drive.mode)
            for name, drive in profile.drives.items()
        },
        limits=serial_limits(profile.limits, deceleration, 1.0 / network.cycle_hz, line.cycle_s),
    )


def serial_limits(limits: Limits, deceleration_m_s2: float, can_cycle_s: float, serial_cycle_s: float) -> Limits:
    """The vehicle's limits over a line: speeds as :func:`serial_speed_m_s` says, steering in proportion to the rate."""
    speed = serial_speed_m_s(limits.speed_m_s, deceleration_m_s2, can_cycle_s, serial_cycle_s)
    steering = limits.steering_rim_speed_m_s * min(1.0, 4 * can_cycle_s / serial_cycle_s)
    return msgspec.structs.replace(
        limits,
        speed_m_s=round(speed, 3),
        wheel_speed_m_s=round(limits.wheel_speed_m_s * speed / limits.speed_m_s, 3),
        steering_rim_speed_m_s=round(steering, 3),
        heading_tolerance_deg=max(limits.heading_tolerance_deg, HEADING_TOLERANCE_DEG),
    )


def stopping_time_s(profile: Profile, speed_m_s: float) -> float:
    """Time from a line that falls silent to wheels at rest: guarding runs out, the quick-stop ramp, coasting [s].

    Args:
        profile: as :func:`serial_profile` makes it.
        speed_m_s: rim speed of the fastest wheel.
    """
    life_s = profile.network.guard_time_ms * profile.network.life_time_factor / 1e3
    ramp_s = abs(speed_m_s) / min(drive.quick_stop_m_s2 for drive in profile.drives.values())
    return life_s + ramp_s + COASTING_S


def stopping_way_m(profile: Profile, speed_m_s: float) -> float:
    """The way that a wheel rolls in that time [m]."""
    life_s = profile.network.guard_time_ms * profile.network.life_time_factor / 1e3
    ramp = min(drive.quick_stop_m_s2 for drive in profile.drives.values())
    return abs(speed_m_s) * life_s + speed_m_s**2 / (2.0 * ramp) + COASTING_M


def stopping_turn_rad(profile: Profile) -> float | None:
    """By how much a pair that is being turned turns on in that time [rad]; None for a robot without such pairs."""
    if not isinstance(profile.vehicle, PairedSteerGeometry):
        return None
    way_m = stopping_way_m(profile, profile.limits.steering_rim_speed_m_s)
    return way_m / profile.vehicle.contact_offset_m if profile.vehicle.contact_offset_m else math.pi


def facts(profile: Profile, baud: int) -> dict[str, Any]:
    """What can be said of a profile over a line before it is tried, for ``status`` and ``doctor``.

    Args:
        profile: the robot as it is on CAN.
        baud: of the line.
    """
    shrunk = serial_profile(profile, baud)
    top, turn_rad = shrunk.limits.wheel_speed_m_s, stopping_turn_rad(shrunk)
    return {
        "planned_hz": round(shrunk.network.cycle_hz, 1),
        "planned_hz_at_baud": {str(rate): round(plan(profile, rate).cycle_hz, 1) for rate in (115200, 38400)},
        "speed_limit_m_s": shrunk.limits.speed_m_s,
        "silent_line_stop_s": round(stopping_time_s(shrunk, top), 2),
        "silent_line_stop_m": round(stopping_way_m(shrunk, top), 2),
        "silent_line_turn_deg": None if turn_rad is None else round(math.degrees(turn_rad)),
    }
