"""An EPOS 24/5 that nobody has described yet: what it says of itself, in words, and a profile to jog its motor with.

Reading changes nothing. The profile keeps what the drive is set to and caps speed, ramp and current.
"""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

from canhelm.errors import Refused
from drivers.canopen.objects import ObjectDef
from drivers.epos.configure import HARDWARE_24_5, HARDWARE_MASK, VENDOR_MAXON, emergency_words
from drivers.epos.objects import OBJECTS
from drivers.epos.parameters import MOTOR_TYPES, SENSOR_TYPES
from drivers.epos.state_machine import STATES, state_of
from drivers.epos.value_tables import VALUE_TABLES
from profiles.schema import DriveConfig, Motor

Read = Callable[[ObjectDef], Awaitable[int]]
JOG_CURRENT_A = 0.5
JOG_RPM = 500
JOG_RAMP_RPM_S = 1000
LEAST_PULSES = 16
_RPM_PER_M_S = 1000.0
"""What is on the shaft is unknown: a wheel of 60 mm circumference stands for it."""
_SETTINGS = (
    "motor_type",
    "position_sensor_type",
    "encoder_pulses_per_turn",
    "pole_pairs",
    "thermal_time_constant_winding",
    "continuous_current_limit",
    "output_current_limit",
    "max_following_error",
)


@dataclass(frozen=True, slots=True)
class FirstLook:
    """What a drive says before anything is changed.

    Attributes:
        node: its node id.
        firmware: version, as 0x2011.
        statusword: 0x6041.
        errors: codes of its error history, the newest first.
        settings: values of what it is set to, by object name, in the objects' units.
    """

    node: int
    firmware: int
    statusword: int
    errors: tuple[int, ...]
    settings: dict[str, int]

    @property
    def state(self) -> str:
        """Its state in words, with what to do about it."""
        known = state_of(self.statusword)
        if known is None:
            return f"statusword 0x{self.statusword:04X}, which is no state of it"
        return " ".join(part for part in (f"{known.words}:", STATES[known].meaning, STATES[known].cure) if part)

    @property
    def sentences(self) -> list[str]:
        """What there is to say of it, for people: state, motor, limits, recorded errors."""
        told = self.settings
        motor = f"{_words('motor_type', told)}, {told['pole_pairs']} pole pairs"
        sensor = f"{_words('position_sensor_type', told)}, {told['encoder_pulses_per_turn']} pulses a turn"
        limits = f"{told['continuous_current_limit']} mA for ever, {told['output_current_limit']} mA at most"
        recorded = [f"recorded error: {meaning} - {cure}" for meaning, cure in map(emergency_words, self.errors)]
        return [self.state, f"set to motor: {motor}; sensor: {sensor}; current: {limits}", *recorded]

    def row(self) -> dict[str, Any]:
        """The drive for ``status``."""
        return {
            "node": self.node,
            "device": "EPOS 24/5",
            "firmware": f"{self.firmware:04X}",
            "state": self.state,
            "errors": [f"0x{code:04X}" for code in self.errors],
            **self.settings,
        }

    def config(self) -> DriveConfig:
        """A profile that jogs the motor: set as it is, capped at ``JOG_RPM`` and ``JOG_CURRENT_A``.

        Raises:
            Refused: its motor, sensor or number of pulses is none that canhelm drives.
        """
        told = self.settings
        if told["encoder_pulses_per_turn"] < LEAST_PULSES:
            raise self._unfit("encoder_pulses_per_turn", f"write {LEAST_PULSES} or more, save, restart")
        return DriveConfig(
            node=self.node,
            motor=self._motor(),
            encoder_pulses_per_turn=told["encoder_pulses_per_turn"],
            position_sensor=self._choice(SENSOR_TYPES, "position_sensor_type"),
            gear_ratio=1.0,
            wheel_radius_m=60.0 / (_RPM_PER_M_S * 2.0 * math.pi),
            max_speed_m_s=(JOG_RPM + 1) / _RPM_PER_M_S,
            acceleration_m_s2=JOG_RAMP_RPM_S / _RPM_PER_M_S,
            quick_stop_m_s2=2 * JOG_RAMP_RPM_S / _RPM_PER_M_S,
            continuous_current_a=min(JOG_CURRENT_A, 1e-3 * max(1, told["continuous_current_limit"])),
            output_current_a=min(JOG_CURRENT_A, 1e-3 * max(1, told["output_current_limit"])),
            max_following_error_qc=told["max_following_error"],
        )

    def _motor(self) -> Motor:
        """Only what is written to the drive counts of it; the rest describes no motor in particular."""
        return Motor(
            type=self._choice(MOTOR_TYPES, "motor_type"),
            pole_pairs=self.settings["pole_pairs"],
            thermal_time_constant_s=0.1 * self.settings["thermal_time_constant_winding"],
            nominal_voltage_v=24.0,
            nominal_speed_rpm=JOG_RPM,
            nominal_torque_n_m=0.01,
            nominal_current_a=JOG_CURRENT_A,
            torque_constant_n_m_a=0.02,
            resistance_ohm=1.0,
            rotor_inertia_kg_m2=1e-6,
        )

    def _choice(self, types: dict[str, int], name: str) -> Any:
        """The profile's word for a value of an object. Raises Refused where it has none."""
        for word, value in types.items():
            if value == self.settings[name]:
                return word
        known = ", ".join(f"{value} ({word})" for word, value in types.items())
        raise self._unfit(name, f"set it to one of {known}, save, restart")

    def _unfit(self, name: str, remedy: str) -> Refused:
        value = self.settings[name]
        return Refused(
            f"node {self.node} is set to {name} {value}, which canhelm does not drive",
            node=self.node,
            object=OBJECTS[name].address,
            value=value,
            remedy=remedy,
        )


def _words(name: str, settings: dict[str, int]) -> str:
    return VALUE_TABLES[name].get(settings[name], f"type {settings[name]}")


async def first_look(node: int, read: Read) -> FirstLook:
    """Read what a drive says of itself.

    Args:
        node: its node id.
        read: reads one of its objects.

    Raises:
        Refused: it is no EPOS 24/5.
        NodeAbsent, Timeout, Aborted: it does not answer, or lacks an object.
    """
    vendor, hardware = await read(OBJECTS["vendor_id"]), await read(OBJECTS["hardware_version"])
    if vendor != VENDOR_MAXON or hardware & HARDWARE_MASK != HARDWARE_24_5:
        raise Refused(
            f"node {node} is no EPOS 24/5 (vendor {vendor}, hardware 0x{hardware:04X})",
            node=node,
            remedy="canhelm drives the EPOS 24/5; `canhelm sdo read` reads other nodes",
        )
    count = await read(OBJECTS["number_of_recorded_errors"])
    history = [OBJECTS[f"error_history_entry_{entry}"] for entry in range(1, min(count, 5) + 1)]
    return FirstLook(
        node,
        await read(OBJECTS["software_version"]),
        await read(OBJECTS["statusword"]),
        tuple([await read(entry) & 0xFFFF for entry in history]),
        {name: await read(OBJECTS[name]) for name in _SETTINGS},
    )
