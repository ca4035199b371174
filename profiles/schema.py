"""What a robot's profile says: types, units and defaults. Every number of a robot that code needs stands here.

A profile is YAML; ``profiles.loader`` reads it, merges ``extends:``, checks it and builds these objects. Values that the
sources do not give carry the tag ``!assumed`` in YAML; the loader lists them in :attr:`Profile.assumed`.

Frames and signs: x forward, y left, angles counter-clockwise positive, a wheel's speed positive when it rolls forward.
"""

from __future__ import annotations

from typing import Literal

import msgspec

SCHEMA_VERSION = 1


class Part(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Common base: unknown keys are errors, values do not change."""


class Network(Part):
    """The CAN network and its timing."""

    bit_rate: int = 1_000_000
    """bit/s"""
    cycle_hz: float = 100.0
    """Control cycles (and SYNCs) per second."""
    guard_time_ms: int = 100
    """Time between two guard requests to a node (object 0x100C)."""
    life_time_factor: int = 3
    """Guard times without a request after which a node declares its master lost (object 0x100D)."""
    boot_deadline_s: float = 3.0
    """Time one attempt to configure a node may take before it is started over."""
    sdo_timeout_s: float = 0.25


class Motor(Part):
    """A motor's data. What the drive is set to and what the simulation computes with."""

    type: Literal["brushed_dc", "brushless_sine", "brushless_block"] = "brushless_block"
    nominal_voltage_v: float
    nominal_speed_rpm: float
    nominal_torque_n_m: float
    nominal_current_a: float
    torque_constant_n_m_a: float
    resistance_ohm: float
    rotor_inertia_kg_m2: float
    no_load_current_a: float = 0.0
    pole_pairs: int = 1
    thermal_time_constant_s: float = 4.0


class DriveConfig(Part):
    """One drive with its motor, gear, encoder and wheel."""

    node: int
    device: Literal["epos24_5"] = "epos24_5"
    motor: Motor
    encoder_pulses_per_turn: int
    """Pulses; quad counts (qc) are four times as many."""
    gear_ratio: float
    """Motor turns per turn of the gear's output."""
    gear_efficiency: float = 1.0
    belt_ratio: float = 1.0
    """Turns of the gear's output per turn of the wheel."""
    wheel_radius_m: float
    direction: Literal[1, -1] = 1
    """1: positive motor speed rolls the wheel forward; -1: the motor is mounted mirrored."""
    mode: Literal["profile_velocity", "velocity"] = "profile_velocity"
    """Mode of operation for driving: 3 (object 0x60FF) or -2 (object 0x206B)."""
    max_speed_m_s: float
    """Limit of the wheel's speed, enforced before encoding and written to the drive where it has an object for it."""
    acceleration_m_s2: float
    """Ramp of the drive for a new target velocity, at the wheel's rim (objects 0x6083, 0x6084)."""
    quick_stop_m_s2: float
    """Ramp of the drive for quick stop and for faults of class Q (object 0x6085)."""
    continuous_current_a: float
    output_current_a: float
    max_following_error_qc: int = 2000

    @property
    def qc_per_motor_turn(self) -> int:
        """Quad counts per motor turn."""
        return 4 * self.encoder_pulses_per_turn

    @property
    def total_ratio(self) -> float:
        """Motor turns per wheel turn."""
        return self.gear_ratio * self.belt_ratio


class EncoderConfig(Part):
    """One steering encoder (CiA 406) on the vertical axis of a wheel pair."""

    node: int
    device: Literal["cia406"] = "cia406"
    counts_per_turn: int
    total_counts: int | None = None
    """Measuring range (object 0x6002); None: the same as counts_per_turn (single-turn)."""
    direction: Literal[1, -1] = 1
    """1: counts grow when the pair turns counter-clockwise."""
    zero_counts: int = 0
    """Position value at heading 0."""


class BrakeConfig(Part):
    """One brake, switched by a digital output of a drive."""

    kind: Literal["steering", "holding"]
    """steering: locks the heading of a wheel pair, wheels roll on; holding: stops an axis."""
    drive: str
    """Name of the drive whose output switches it."""
    output: Literal[1, 2, 3, 4] = 4
    """Number of the digital output (DigOUT4 carries up to 1 A)."""
    output_bit: Literal[12, 13, 14, 15] = 12
    """Bit of objects 0x2078 and 0x2079 that stands for it."""
    energise_to_release: bool = True
    open_time_s: float
    close_time_s: float


class PairedSteerGeometry(Part):
    """Geometry and body of a four-wheel robot whose wheels steer in pairs (MAX2D thesis, chapter 4)."""

    type: Literal["paired_steer"] = "paired_steer"
    mass_kg: float
    wheelbase_m: float
    """l: distance between the steering axes of the rear and the front pair."""
    pivot_track_m: float
    """h: distance between the steering axes of the right and the left side."""
    contact_offset_m: float
    """a: from a steering axis outward along the axle to the wheel's contact point."""
    contact_lead_m: float
    """b: from a steering axis outward along the heading (front pair forward, rear pair backward)."""
    max_heading_deg: float
    """Steering stops: a pair turns at most this far to each side."""
    wheels: tuple[str, str, str, str]
    """Names of the drives of wheels 1 to 4: rear right, rear left, front left, front right."""
    encoders: tuple[str, str]
    """Names of the steering encoders: rear, front."""
    brakes: tuple[str, str]
    """Names of the steering brakes: rear, front."""
    yaw_inertia_kg_m2: float
    centre_of_mass_height_m: float = 0.0


class Limits(Part):
    """What the vehicle may do; the gate before encoding enforces it."""

    speed_m_s: float
    """Of the vehicle's centre."""
    acceleration_m_s2: float
    wheel_speed_m_s: float
    steering_rim_speed_m_s: float
    """Rim speed of the wheels while a pair turns."""
    heading_deg: float
    """Steering heading that commands may ask for (within the stops)."""
    heading_tolerance_deg: float = 0.2
    """A pair counts as steered when it is closer to its target than this."""


class Tyre(Part):
    """Tyre data of the simulation."""

    friction: float
    """Coefficient of friction between tyre and floor."""
    slip_stiffness: float
    """Longitudinal force per unit of slip ratio, in multiples of the wheel's load."""
    cornering_stiffness_per_rad: float
    """Lateral force per radian of slip angle, in multiples of the wheel's load."""
    relaxation_length_m: float
    rolling_resistance: float = 0.0
    """Coefficient of rolling resistance."""


class SimulationConfig(Part):
    """What only the simulated network needs to know."""

    tyre: Tyre
    supply_voltage_v: float = 24.0
    wheel_inertia_kg_m2: float
    steering_inertia_kg_m2: float
    """Of one wheel pair about its steering axes, wheels and coupling belt together."""
    steering_friction_n_m: float
    """Dry friction of one pair's steering axes and coupling belt."""
    brake_holding_torque_n_m: float
    """Torque at which an engaged steering brake slips."""


class Profile(Part):
    """A robot: network, drives, encoders, brakes, vehicle, limits, simulation."""

    schema_version: int
    name: str
    description: str = ""
    network: Network = Network()
    drives: dict[str, DriveConfig]
    encoders: dict[str, EncoderConfig] = {}
    brakes: dict[str, BrakeConfig] = {}
    vehicle: PairedSteerGeometry | None = None
    limits: Limits
    simulation: SimulationConfig | None = None

    def drive_of_node(self, node: int) -> str | None:
        """Name of the drive with this node id."""
        return next((name for name, drive in self.drives.items() if drive.node == node), None)
