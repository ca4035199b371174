"""The settings of an EPOS 24/5: which objects they are, what a profile expects of them, how they are written."""

from __future__ import annotations

import math
from collections.abc import Mapping

import msgspec

from drivers.canopen.dcf import DeviceKind
from drivers.canopen.objects import Access, ObjectDef
from drivers.canopen.pdo import AT_ONCE, ON_SYNC, Settings, rpdo_settings, tpdo_settings
from drivers.epos.codec import DRIVING_MODES, RPDO1_MAPS, TPDO1_MAP, TPDO2_MAP
from drivers.epos.objects import OBJECTS
from drivers.epos.units import WheelUnits
from drivers.epos.value_tables import CAN_BIT_RATES
from profiles.schema import DriveConfig, Network

EPOS_24_5 = DeviceKind(
    vendor="maxon motor ag",
    vendor_number=0xFB,
    product="EPOS 24/5",
    product_number=0x6210_2011,
    bit_rates=frozenset(CAN_BIT_RATES.values()),
    receive_pdos=3,
    transmit_pdos=3,
)
MOTOR_TYPES = {"brushed_dc": 1, "brushless_sine": 10, "brushless_block": 11}
SENSOR_TYPES = {"encoder_with_index": 1, "encoder": 2, "hall": 3}
GAINS = {
    "current_p": "current_regulator_p_gain",
    "current_i": "current_regulator_i_gain",
    "velocity_p": "velocity_regulator_p_gain",
    "velocity_i": "velocity_regulator_i_gain",
    "position_p": "position_regulator_p_gain",
    "position_i": "position_regulator_i_gain",
    "position_d": "position_regulator_d_gain",
}
"""Objects of the regulator gains by their names in a profile."""
OVERSPEED_MARGIN = 1.2

ADDRESSING = tuple(OBJECTS[name] for name in ("node_id_software", "can_bit_rate_code", "rs232_baud_rate_code"))
"""How the drive is reached. Noted with its settings, never changed with them."""
_COMMANDS = (
    0x1003, 0x1005, 0x1010, 0x1011, 0x1020, 0x2010, 0x2011, 0x2012, 0x2013, 0x2014, 0x2015, 0x2016, 0x2023, 0x2025,
    0x2026, 0x2030, 0x2062, 0x206B, 0x2FFF, 0x6040, 0x607A, 0x60FF,
)  # fmt: skip
"""Writable objects that are commands, set values, history or the maker's service."""
_OUTPUT_STATE = (0x2078, 1)
SETTINGS = tuple(
    entry
    for entry in OBJECTS.objects
    if entry.access is Access.RW and entry.index not in _COMMANDS and (entry.index, entry.sub) != _OUTPUT_STATE
)
"""Objects that shape what the drive does and that it can keep, in the order of the table."""
_GUARDING = (OBJECTS["life_time_factor"], OBJECTS["guard_time"])
_START_UP = (OBJECTS["motor_type"], OBJECTS["position_sensor_type"])
"""Settings that count from the drive's start on (Firmware Specification 14.1.46, 14.1.82)."""


def counts_from_start(entry: ObjectDef) -> bool:
    """Whether a setting takes effect only after it was saved and the drive restarted."""
    return entry in _START_UP


def pdo_plan(config: DriveConfig, *, synchronous: bool = True) -> Settings:
    """COB-IDs, transmission types and mappings; unused PDOs too, because at factory settings all belong to node 1."""
    node, rpdo1_map = config.node, RPDO1_MAPS[DRIVING_MODES[config.mode]]
    cyclic = ON_SYNC if synchronous else AT_ONCE
    tpdo2 = (cyclic, TPDO2_MAP) if config.tells_inputs else (AT_ONCE, None)
    return [
        *rpdo_settings(OBJECTS, 1, node, cyclic, rpdo1_map),
        *rpdo_settings(OBJECTS, 2, node, AT_ONCE),
        *rpdo_settings(OBJECTS, 3, node, AT_ONCE),
        *tpdo_settings(OBJECTS, 1, node, cyclic, TPDO1_MAP),
        *tpdo_settings(OBJECTS, 2, node, *tpdo2),
        *tpdo_settings(OBJECTS, 3, node, AT_ONCE),
    ]


def parameter_plan(config: DriveConfig) -> Settings:
    """Limits, ramps and motor data of the profile in the drive's units."""
    units = WheelUnits.of(config)
    top_rpm = math.ceil(config.max_speed_m_s * abs(units.rpm_per_m_s))
    ramp_rpm_s = units.ramp_rpm_s(config.acceleration_m_s2)
    by_name = {
        "profile_acceleration": ramp_rpm_s,
        "profile_deceleration": ramp_rpm_s,
        "quick_stop_deceleration": units.ramp_rpm_s(config.quick_stop_m_s2),
        "max_profile_velocity": top_rpm,
        "max_following_error": config.max_following_error_qc,
        "continuous_current_limit": round(1e3 * config.continuous_current_a),
        "output_current_limit": round(1e3 * config.output_current_a),
        "pole_pairs": config.motor.pole_pairs,
        "max_speed_in_current_mode": round(OVERSPEED_MARGIN * top_rpm),
        "thermal_time_constant_winding": round(10 * config.motor.thermal_time_constant_s),
        **gains_of(config),
    }
    return [(OBJECTS[name], value) for name, value in by_name.items()]


def gains_of(config: DriveConfig) -> dict[str, int]:
    """The gains that the profile gives, by object name."""
    given = msgspec.structs.asdict(config.gains) if config.gains else {}
    return {GAINS[name]: value for name, value in given.items() if value is not None}


def guarding_plan(network: Network) -> Settings:
    """Life guarding; it begins with the first request (Firmware Specification 14.1.6, 14.1.7)."""
    return [
        (OBJECTS["guard_time"], network.guard_time_ms),
        (OBJECTS["life_time_factor"], network.life_time_factor),
    ]


def start_up_plan(config: DriveConfig) -> Settings:
    """Settings that must stand in the drive's non-volatile memory, because they count from its start on."""
    values = (MOTOR_TYPES[config.motor.type], SENSOR_TYPES[config.position_sensor])
    return list(zip(_START_UP, values, strict=True))


def expected_settings(config: DriveConfig, network: Network) -> dict[ObjectDef, int]:
    """The whole configuration that a profile expects of a drive."""
    pulses = (OBJECTS["encoder_pulses_per_turn"], config.encoder_pulses_per_turn)
    mode = (OBJECTS["mode_of_operation"], int(DRIVING_MODES[config.mode]))
    pdos = pdo_plan(config, synchronous=network.synchronous)
    plans = (pdos, parameter_plan(config), start_up_plan(config), guarding_plan(network))
    return dict(setting for plan in plans for setting in plan) | dict((pulses, mode))


def write_order(wanted: Mapping[ObjectDef, int], found: Mapping[ObjectDef, int]) -> Settings:
    """What to write, and in which order, so that a drive with the settings ``found`` gets those ``wanted``.

    A mapping is written whole: its count to 0, its entries, its count (Firmware Specification 14.1.16). Guarding comes
    last, so that it does not run out while the rest is written.
    """
    changed = [entry for entry, value in wanted.items() if found.get(entry) != value]
    remapped = {entry.index for entry in changed if is_mapping(entry)}
    order: Settings = [(entry, wanted[entry]) for entry in changed if not is_mapping(entry) and entry not in _GUARDING]
    for index in sorted(remapped):
        order += _mapping_settings(index, {**found, **wanted})
    return order + [(entry, wanted[entry]) for entry in changed if entry in _GUARDING]


def is_mapping(entry: ObjectDef) -> bool:
    """Whether an object belongs to a PDO mapping."""
    return 0x1600 <= entry.index < 0x1800 or 0x1A00 <= entry.index < 0x1C00


def _mapping_settings(index: int, values: Mapping[ObjectDef, int]) -> Settings:
    count, *entries = sorted((entry for entry in values if entry.index == index), key=lambda entry: entry.sub)
    mapped = [(entry, values[entry]) for entry in entries if entry.sub <= values[count]]
    return [(count, 0), *mapped, (count, values[count])]


def without_unmapped(values: Mapping[ObjectDef, int]) -> dict[ObjectDef, int]:
    """Settings without those mapping entries that the count of their PDO leaves out: they mean nothing."""
    counts = {entry.index: value for entry, value in values.items() if is_mapping(entry) and entry.sub == 0}
    return {
        entry: value
        for entry, value in values.items()
        if not is_mapping(entry) or entry.sub <= counts.get(entry.index, entry.sub)
    }
