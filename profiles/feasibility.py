"""Whether mass, tyres, motors, supply and bus allow what a profile asks for.

Each check names the largest value that is permitted. A part with mistakes of its own is left out: it is checked when
those are mended.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

import msgspec

from profiles.checks import Finding, part
from profiles.schema import (
    DriveConfig,
    EncoderConfig,
    Limits,
    Network,
    PairedSteerGeometry,
    Part,
    SimulationConfig,
)

GRAVITY_M_S2 = 9.81
VOLTAGE_SHARE = 0.9
"""Share of the supply that speed may use; the rest is left to the current controller."""
MAX_MOTOR_SPEED_RPM = 25_000
"""Upper limit of object 0x607F (maxon EPOS firmware 2011h EDS)."""
CURRENT_RATIO = 2.0
"""Output current limit over continuous current limit (Firmware Specification 14.1.57 recommends twice)."""
BUS_SHARE = 0.7
"""Share of a cycle that SYNC and the PDOs may take; the rest is left to guarding, SDO and emergency messages."""
RPDO_BYTES, TPDO_BYTES, ENCODER_BYTES = 6, 8, 4

T = TypeVar("T", bound=Part)


@dataclass(frozen=True, slots=True)
class Load:
    """What one wheel has to move and to hold on to."""

    mass_kg: float
    """Its share of the vehicle's mass."""
    wheel_inertia_kg_m2: float
    friction: float
    rolling_resistance: float


def findings(data: dict[str, Any]) -> Iterator[Finding]:
    """Everything in a profile's plain data that physics, the drives or the bus do not allow."""
    limits = _valid(data.get("limits"), Limits)
    vehicle = _valid(data.get("vehicle"), PairedSteerGeometry)
    simulation = _valid(data.get("simulation"), SimulationConfig)
    encoders = {name: _valid(value, EncoderConfig) for name, value in part(data, "encoders").items()}
    drives = {name: _valid(value, DriveConfig) for name, value in part(data, "drives").items()}
    load = _load(vehicle, simulation)
    if vehicle is not None and data.get("simulation") is None:
        yield Finding(
            ("vehicle",), "no tyre data: ramps are not checked against friction", "add simulation:", warning=True
        )
    for name, drive in drives.items():
        if drive is not None:
            supply_v = simulation.supply_voltage_v if simulation else drive.motor.nominal_voltage_v
            yield from _drive(("drives", name), drive, supply_v, load)
            yield from _limits_of_drive(limits, drive, name)
    yield from _limits(limits, vehicle, encoders)
    yield from _bus(_valid(data.get("network", {}), Network), len(drives), len(encoders))


def _valid(value: Any, kind: type[T]) -> T | None:
    """The part as an object, or None when it is absent or has mistakes."""
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError:
        return None


def _load(vehicle: PairedSteerGeometry | None, simulation: SimulationConfig | None) -> Load | None:
    if vehicle is None:
        return None
    mass_kg = vehicle.mass_kg / len(vehicle.wheels)
    if simulation is None:
        return Load(mass_kg, wheel_inertia_kg_m2=0.0, friction=math.inf, rolling_resistance=0.0)
    tyre = simulation.tyre
    return Load(mass_kg, simulation.wheel_inertia_kg_m2, tyre.friction, tyre.rolling_resistance)


def max_speed_m_s(drive: DriveConfig, supply_v: float) -> float:
    """Rim speed in m/s that the supply allows at the continuous current, and the drive at all.

    The motor's voltage balance U = k w + R I, with k in N m/A (equal to V s/rad).
    """
    motor = drive.motor
    motor_rad_s = VOLTAGE_SHARE * supply_v - motor.resistance_ohm * drive.continuous_current_a
    motor_rad_s /= motor.torque_constant_n_m_a
    motor_rad_s = min(max(motor_rad_s, 0.0), MAX_MOTOR_SPEED_RPM * math.tau / 60)
    return motor_rad_s * drive.wheel_radius_m / drive.total_ratio


def rim_force_n(drive: DriveConfig) -> float:
    """Force in N at the rim with the output current: F = k (I - I0) i eta / r."""
    current_a = max(drive.output_current_a - drive.motor.no_load_current_a, 0.0)
    torque_n_m = drive.motor.torque_constant_n_m_a * current_a * drive.total_ratio * drive.gear_efficiency
    return torque_n_m / drive.wheel_radius_m


def moved_mass_kg(drive: DriveConfig, load: Load) -> float:
    """Mass in kg that one wheel's force accelerates: m + (J_wheel + i^2 J_rotor) / r^2."""
    inertia_kg_m2 = load.wheel_inertia_kg_m2 + drive.total_ratio**2 * drive.motor.rotor_inertia_kg_m2
    return load.mass_kg + inertia_kg_m2 / drive.wheel_radius_m**2


def max_acceleration_m_s2(drive: DriveConfig, load: Load) -> float:
    """Largest acceleration in m/s^2: motor force less rolling resistance, and no more than friction holds, mu g.

    With all wheels driven each carries and pushes its own share of the weight, so that mass cancels out of mu m g / m.
    """
    rolling_n = load.rolling_resistance * load.mass_kg * GRAVITY_M_S2
    by_motor = (rim_force_n(drive) - rolling_n) / moved_mass_kg(drive, load)
    return max(0.0, min(by_motor, load.friction * GRAVITY_M_S2))


def max_deceleration_m_s2(drive: DriveConfig, load: Load) -> float:
    """Largest deceleration in m/s^2: motor force, and no more than friction holds.

    Rolling resistance and the gear's losses help to brake and are left as reserve.
    """
    return min(rim_force_n(drive) / moved_mass_kg(drive, load), load.friction * GRAVITY_M_S2)


def _drive(path: tuple[str, str], drive: DriveConfig, supply_v: float, load: Load | None) -> Iterator[Finding]:
    nominal_a, continuous_a = drive.motor.nominal_current_a, drive.continuous_current_a
    yield from _at_most((*path, "continuous_current_a"), continuous_a, nominal_a, "A", "the motor carries")
    allowed_a = CURRENT_RATIO * continuous_a
    yield from _at_most((*path, "output_current_a"), drive.output_current_a, allowed_a, "A", "twice the continuous is")
    allowed = max_speed_m_s(drive, supply_v)
    yield from _at_most((*path, "max_speed_m_s"), drive.max_speed_m_s, allowed, "m/s", f"{supply_v:g} V allow")
    if load is None:
        return
    reason = "mass, tyre and current allow"
    allowed = max_acceleration_m_s2(drive, load)
    yield from _at_most((*path, "acceleration_m_s2"), drive.acceleration_m_s2, allowed, "m/s^2", reason)
    allowed = max_deceleration_m_s2(drive, load)
    yield from _at_most((*path, "quick_stop_m_s2"), drive.quick_stop_m_s2, allowed, "m/s^2", reason)


def _limits_of_drive(limits: Limits | None, drive: DriveConfig, name: str) -> Iterator[Finding]:
    if limits is None:
        return
    path = ("limits", "wheel_speed_m_s")
    yield from _at_most(path, limits.wheel_speed_m_s, drive.max_speed_m_s, "m/s", f"drive {name} allows")
    path = ("limits", "acceleration_m_s2")
    yield from _at_most(path, limits.acceleration_m_s2, drive.acceleration_m_s2, "m/s^2", f"drive {name} allows")


def _limits(
    limits: Limits | None, vehicle: PairedSteerGeometry | None, encoders: dict[str, EncoderConfig | None]
) -> Iterator[Finding]:
    if limits is None:
        return
    wheel_m_s = limits.wheel_speed_m_s
    yield from _at_most(("limits", "speed_m_s"), limits.speed_m_s, wheel_m_s, "m/s", "the wheels' limit is")
    path = ("limits", "steering_rim_speed_m_s")
    yield from _at_most(path, limits.steering_rim_speed_m_s, wheel_m_s, "m/s", "the wheels' limit is")
    if vehicle is not None and limits.heading_deg >= vehicle.max_heading_deg:
        what = f"is {limits.heading_deg:g} deg, the stops are at {vehicle.max_heading_deg:g} deg"
        yield Finding(("limits", "heading_deg"), what, f"write less than {vehicle.max_heading_deg:g}")
    counts = [encoder.counts_per_turn for encoder in encoders.values() if encoder is not None]
    if counts and limits.heading_tolerance_deg < 360 / min(counts):
        what = f"is {limits.heading_tolerance_deg:g} deg, one count of the encoder is {360 / min(counts):.3g} deg"
        yield Finding(("limits", "heading_tolerance_deg"), what, "write one count or more")


def _worst_frame_bits(data_bytes: int) -> int:
    """Longest base frame with stuff bits and interframe space (ISO 11898-1; 34 of its 47 fixed bits are stuffed)."""
    return 47 + 8 * data_bytes + (33 + 8 * data_bytes) // 4


def _bus(network: Network | None, drives: int, encoders: int) -> Iterator[Finding]:
    """SYNC, one RPDO and one TPDO a drive and one TPDO an encoder have to fit into their share of a cycle."""
    if network is None:
        return
    bits = _worst_frame_bits(0) + encoders * _worst_frame_bits(ENCODER_BYTES)
    bits += drives * (_worst_frame_bits(RPDO_BYTES) + _worst_frame_bits(TPDO_BYTES))
    allowed = BUS_SHARE * network.bit_rate / bits
    yield from _at_most(("network", "cycle_hz"), network.cycle_hz, allowed, "Hz", "the bit rate allows")


def _at_most(path: tuple[str, ...], value: float, allowed: float, unit: str, reason: str) -> Iterator[Finding]:
    if value > allowed * (1 + 1e-9):
        largest = _rounded_down(allowed)
        yield Finding(path, f"is {value:g} {unit}, {reason} {largest:g} {unit}", f"write at most {largest:g}")


def _rounded_down(value: float) -> float:
    """Three significant digits, towards zero, so that the named value is itself permitted."""
    if value <= 0:
        return 0.0
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.floor(value / step * (1 + 1e-9)) * step
