"""Whether mass, tyres, motors, supply and bus allow what a profile asks for.

Each check names the largest value that is permitted. A part with mistakes of its own is left out: it is checked when
those are mended.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

import msgspec

from profiles.bricks import NxtMotorConfig
from profiles.checks import Finding, part
from profiles.parts import Part
from profiles.provenance import dotted
from profiles.schema import (
    BodyGeometry,
    DriveConfig,
    EncoderConfig,
    Limits,
    Network,
    OmniGeometry,
    PairedSteerGeometry,
    Profile,
    SimulationConfig,
)
from profiles.steered import CarGeometry, SemitrailerGeometry, SteeredAxle

GRAVITY_M_S2 = 9.81
VOLTAGE_SHARE = 0.9
"""Share of the supply that speed may use; the rest is left to the current controller."""
MAX_MOTOR_SPEED_RPM = 25_000
"""Upper limit of object 0x607F (maxon EPOS firmware 2011h EDS)."""
CURRENT_RATIO = 2.0
"""Output current limit over continuous current limit (Firmware Specification 14.1.57 recommends twice)."""
BUS_SHARE = 0.7
"""Share of a cycle that SYNC and the PDOs may take; the rest is left to guarding, SDO and emergency messages."""
BRICK_FULL_SPEED_DEG_S = 1000.0
"""Speed that an NXT brick regulates to at power 100 (LEGO firmware)."""
RPDO_BYTES, TPDO_BYTES, ENCODER_BYTES, INPUT_BYTES = 6, 8, 4, 6
OMNI_SHARE = 2.0
"""Mass that an omni-wheel pushes along its direction, over its share of the mass: wheels that stand evenly about the
robot have the best force in their own direction, sum of cos^2 = n/2, and each of n does 2/n of the work."""
LEAST_DETERMINANT = 1e-3

T = TypeVar("T", bound=Part)


@dataclass(frozen=True, slots=True)
class Load:
    """What one wheel has to move and to hold on to."""

    mass_kg: float
    """What of the vehicle's mass it pushes."""
    weight_n: float
    """What of the vehicle's weight it carries."""
    wheel_inertia_kg_m2: float
    friction: float
    rolling_resistance: float


def findings(data: dict[str, Any]) -> Iterator[Finding]:
    """Everything in a profile's plain data that physics, the drives or the bus do not allow."""
    limits = _valid(data.get("limits"), Limits)
    vehicle = _vehicle(data.get("vehicle"))
    simulation = _valid(data.get("simulation"), SimulationConfig)
    encoders = {name: _valid(value, EncoderConfig) for name, value in part(data, "encoders").items()}
    drives = {name: _valid(value, DriveConfig) for name, value in part(data, "drives").items()}
    load = _load(vehicle, simulation)
    steering = vehicle.steering if isinstance(vehicle, CarGeometry | SemitrailerGeometry) else None
    if vehicle is not None and data.get("simulation") is None:
        yield Finding(
            ("vehicle",), "no tyre data: ramps are not checked against friction", "add simulation:", warning=True
        )
    for name, drive in drives.items():
        if drive is not None:
            supply_v = simulation.supply_voltage_v if simulation else drive.motor.nominal_voltage_v
            if steering is not None and name == steering.drive:
                yield from _drive(("drives", name), drive, supply_v, _steering_load(simulation))
                yield from _steering_limits(steering, drive, name)
            else:
                yield from _drive(("drives", name), drive, supply_v, load)
                yield from _limits_of_drive(limits, drive, name)
    for brick in part(data, "bricks"):
        yield from _brick_motors(data, brick, limits)
    yield from _limits(limits, vehicle, encoders)
    telling = sum(drive is not None and drive.tells_inputs for drive in drives.values())
    yield from _bus(_valid(data.get("network", {}), Network), len(drives), len(encoders), telling)


def objection(profile: Profile) -> str:
    """The first thing that physics, the drives or the bus do not allow; empty where they allow everything."""
    mistakes = (finding for finding in findings(msgspec.to_builtins(profile)) if not finding.warning)
    return next((f"{dotted(mistake.path)} {mistake.what}" for mistake in mistakes), "")


def _valid(value: Any, kind: type[T]) -> T | None:
    """The part as an object, or None when it is absent or has mistakes."""
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError:
        return None


def _vehicle(value: Any) -> BodyGeometry | None:
    kinds: dict[str, type[BodyGeometry]] = {
        kind.type: kind for kind in (PairedSteerGeometry, OmniGeometry, CarGeometry, SemitrailerGeometry)
    }
    kind = kinds.get(str(value.get("type"))) if isinstance(value, dict) else None
    return None if kind is None else _valid(value, kind)


def _load(vehicle: BodyGeometry | None, simulation: SimulationConfig | None) -> Load | None:
    if vehicle is None:
        return None
    pushed_kg, carried_kg = _moved_and_carried_kg(vehicle)
    weight_n = carried_kg * GRAVITY_M_S2
    if simulation is None:
        return Load(pushed_kg, weight_n, wheel_inertia_kg_m2=0.0, friction=math.inf, rolling_resistance=0.0)
    tyre = simulation.tyre
    return Load(pushed_kg, weight_n, simulation.wheel_inertia_kg_m2, tyre.friction, tyre.rolling_resistance)


def _moved_and_carried_kg(vehicle: BodyGeometry) -> tuple[float, float]:
    """What of the vehicle's mass a driven wheel pushes, and what stands on it."""
    if isinstance(vehicle, SemitrailerGeometry):
        return vehicle.mass_kg + vehicle.trailer.mass_kg, vehicle.driven_axle_kg
    share_kg = vehicle.mass_kg / len(vehicle.wheels)
    if isinstance(vehicle, CarGeometry):
        return share_kg, share_kg * (1.0 - vehicle.mass_offset_m / vehicle.wheelbase_m)
    return (OMNI_SHARE * share_kg if isinstance(vehicle, OmniGeometry) else share_kg), share_kg


def _steering_load(simulation: SimulationConfig | None) -> Load:
    """A steered axle on its own: nothing that it pushes, nothing that slips."""
    inertia = simulation.steering_inertia_kg_m2 if simulation else 0.0
    return Load(0.0, 0.0, inertia, friction=math.inf, rolling_resistance=0.0)


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
    """Largest acceleration in m/s^2: motor force less rolling resistance, and no more than friction holds."""
    rolling_n = load.rolling_resistance * load.weight_n
    by_motor = (rim_force_n(drive) - rolling_n) / moved_mass_kg(drive, load)
    return max(0.0, min(by_motor, _by_friction_m_s2(load)))


def max_deceleration_m_s2(drive: DriveConfig, load: Load) -> float:
    """Largest deceleration in m/s^2: motor force, and no more than friction holds.

    Rolling resistance and the gear's losses help to brake and are left as reserve.
    """
    return min(rim_force_n(drive) / moved_mass_kg(drive, load), _by_friction_m_s2(load))


def _by_friction_m_s2(load: Load) -> float:
    """What friction holds: mu g where each wheel pushes its own share of the mass, which then cancels out."""
    return load.friction * load.weight_n / load.mass_kg if load.mass_kg > 0 else math.inf


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


def _steering_limits(steering: SteeredAxle, drive: DriveConfig, name: str) -> Iterator[Finding]:
    arm_m, reason = drive.wheel_radius_m, f"drive {name} allows"
    rate, ramp = math.degrees(drive.max_speed_m_s / arm_m), math.degrees(drive.acceleration_m_s2 / arm_m)
    yield from _at_most(("vehicle", "steering", "rate_deg_s"), steering.rate_deg_s, rate, "deg/s", reason)
    path = ("vehicle", "steering", "acceleration_deg_s2")
    yield from _at_most(path, steering.acceleration_deg_s2, ramp, "deg/s^2", reason)


def _brick_motors(data: dict[str, Any], brick: str, limits: Limits | None) -> Iterator[Finding]:
    wheels = part(data, "vehicle").get("wheels") or ()
    for name, value in part(part(part(data, "bricks"), brick), "motors").items():
        motor, path = _valid(value, NxtMotorConfig), ("bricks", brick, "motors", name, "max_speed_m_s")
        if motor is None:
            continue
        allowed = math.radians(BRICK_FULL_SPEED_DEG_S) * motor.wheel_radius_m
        yield from _at_most(path, motor.max_speed_m_s, allowed, "m/s", "the brick regulates up to")
        if limits is not None and name in wheels:
            wheel, place = limits.wheel_speed_m_s, ("limits", "wheel_speed_m_s")
            yield from _at_most(place, wheel, motor.max_speed_m_s, "m/s", f"motor {name} allows")


def _limits(
    limits: Limits | None, vehicle: BodyGeometry | None, encoders: dict[str, EncoderConfig | None]
) -> Iterator[Finding]:
    if limits is None:
        return
    wheel_m_s = limits.wheel_speed_m_s
    yield from _at_most(("limits", "speed_m_s"), limits.speed_m_s, wheel_m_s, "m/s", "the wheels' limit is")
    if isinstance(vehicle, OmniGeometry):
        yield from _omni_limits(limits, vehicle)
    if isinstance(vehicle, OmniGeometry | CarGeometry | SemitrailerGeometry):
        return
    path = ("limits", "steering_rim_speed_m_s")
    yield from _at_most(path, limits.steering_rim_speed_m_s, wheel_m_s, "m/s", "the wheels' limit is")
    if vehicle is not None and limits.heading_deg >= vehicle.max_heading_deg:
        what = f"is {limits.heading_deg:g} deg, the stops are at {vehicle.max_heading_deg:g} deg"
        yield Finding(("limits", "heading_deg"), what, f"write less than {vehicle.max_heading_deg:g}")
    counts = [encoder.counts_per_turn for encoder in encoders.values() if encoder is not None]
    if counts and limits.heading_tolerance_deg < 360 / min(counts):
        what = f"is {limits.heading_tolerance_deg:g} deg, one count of the encoder is {360 / min(counts):.3g} deg"
        yield Finding(("limits", "heading_tolerance_deg"), what, "write one count or more")


def _omni_limits(limits: Limits, vehicle: OmniGeometry) -> Iterator[Finding]:
    """Speed and turn together may not ask a wheel for more than its limit."""
    yield from _omni_wheels(vehicle)
    lever_m = max(abs(wheel.lever_m) for wheel in vehicle.wheels.values())
    left_m_s = max(0.0, limits.wheel_speed_m_s - limits.speed_m_s)
    if lever_m > 0.0:
        allowed = math.degrees(left_m_s / lever_m)
        reason = "what the wheels' limit leaves beside the speed is"
        yield from _at_most(("limits", "yaw_rate_deg_s"), limits.yaw_rate_deg_s, allowed, "deg/s", reason)


def _omni_wheels(vehicle: OmniGeometry) -> Iterator[Finding]:
    """The wheels must determine the robot's motion: det(M^T M) > 0 with rows (cos, sin, lever over the mean lever)."""
    wheels = vehicle.wheels.values()
    mean_m = sum(abs(wheel.lever_m) for wheel in wheels) / len(wheels) or 1.0
    angles = [math.radians(wheel.direction_deg) for wheel in wheels]
    levers = [wheel.lever_m / mean_m for wheel in wheels]
    columns = ([math.cos(angle) for angle in angles], [math.sin(angle) for angle in angles], levers)
    (a, b, c), (_, d, e), (_, _, f) = ([sum(map(operator.mul, one, other)) for other in columns] for one in columns)
    if a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d) < LEAST_DETERMINANT:
        what = "leave a motion of the robot undetermined"
        yield Finding(("vehicle", "wheels"), what, "check their directions and the signs of their levers")


def _worst_frame_bits(data_bytes: int) -> int:
    """Longest base frame with stuff bits and interframe space (ISO 11898-1; 34 of its 47 fixed bits are stuffed)."""
    return 47 + 8 * data_bytes + (33 + 8 * data_bytes) // 4


def _bus(network: Network | None, drives: int, encoders: int, telling: int) -> Iterator[Finding]:
    """SYNC, one RPDO and one TPDO a drive, one more where it tells its inputs, and one an encoder have to fit."""
    if network is None:
        return
    bits = _worst_frame_bits(0) + encoders * _worst_frame_bits(ENCODER_BYTES)
    bits += drives * (_worst_frame_bits(RPDO_BYTES) + _worst_frame_bits(TPDO_BYTES))
    bits += telling * _worst_frame_bits(INPUT_BYTES)
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
