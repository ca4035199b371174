"""What a robot's profile says: types, units and defaults. Every number of a robot that code needs stands here.

A profile is YAML; ``profiles.loader`` reads it, merges ``extends:``, checks it and builds these objects. Values
that the sources do not give carry the tag ``!assumed``; the loader lists them in ``LoadedProfile.assumed``.

The docstring under a field is its description in the JSON Schema, too.

Frames and signs: x forward, y left, angles counter-clockwise positive, a wheel's speed positive when it rolls forward.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from msgspec import Meta, field

from profiles.bricks import BrickConfig, DifferentialGeometry, NxtMotorConfig
from profiles.gamepad import GamepadConfig
from profiles.localisation import LocalisationConfig, SimulatedScannerConfig
from profiles.own_vehicle import OwnGeometry
from profiles.parts import Length, Name, NotNegative, Offset, Part, Positive, WheelRadius
from profiles.plausibility import PlausibilityConfig
from profiles.sensors import AngleCalibration, SensorDefects
from profiles.steered import CarGeometry, SemitrailerGeometry

SCHEMA_VERSION = 1

NodeId = Annotated[int, Meta(ge=1, le=127)]
Efficiency = Annotated[float, Meta(gt=0, le=1)]
Counts = Annotated[int, Meta(ge=0, le=2**32 - 1)]
Gain = Annotated[int, Meta(ge=0, le=32767)]


class Network(Part, frozen=True, kw_only=True):
    """The CAN network and its timing."""

    bit_rate: Literal[1_000_000, 800_000, 500_000, 250_000, 125_000, 50_000, 20_000] = 1_000_000
    """bit/s; the rates that object 0x2001 of the drive knows."""
    cycle_hz: Annotated[float, Meta(ge=1, le=1000)] = 100.0
    """Control cycles (and SYNCs) per second."""
    guard_time_ms: Annotated[int, Meta(ge=1, le=65535)] = 100
    """Time between two guard requests to a node (object 0x100C)."""
    life_time_factor: Annotated[int, Meta(ge=1, le=255)] = 3
    """Guard times without a request after which a node declares its master lost (object 0x100D)."""
    boot_deadline_s: Positive = 3.0
    """Time one attempt to configure a node may take before it is started over."""
    sdo_timeout_s: Positive = 0.25
    """Time a node has to answer one SDO request."""
    patience_s: Annotated[float, Meta(ge=0)] = 0.0
    """Time for which a request to a dead node may keep the wire from the others; no node is called silent sooner."""
    late_after_cycles: Annotated[float, Meta(ge=1)] = 1.0
    """Periods after which a cycle is late and a target of it is stale; a serial line may be slower than planned."""
    synchronous: bool = True
    """PDOs go with SYNC; without it targets count at once and readings come on request (as over the RS-232 gateway)."""
    gateway: str | None = None
    """Name of the drive that the RS-232 line is plugged into; None: the first one. Only used over RS-232."""


class Motor(Part, frozen=True, kw_only=True):
    """A motor's data. What the drive is set to and what the simulation computes with."""

    type: Literal["brushed_dc", "brushless_sine", "brushless_block"] = "brushless_block"
    nominal_voltage_v: Positive
    nominal_speed_rpm: Positive
    nominal_torque_n_m: Positive
    nominal_current_a: Positive
    torque_constant_n_m_a: Positive
    resistance_ohm: Positive
    rotor_inertia_kg_m2: Positive
    no_load_current_a: NotNegative = 0.0
    pole_pairs: Annotated[int, Meta(ge=1, le=255)] = 1
    thermal_time_constant_s: Annotated[float, Meta(ge=0.1, le=1310.7)] = 4.0
    """Of the winding (object 0x6410/5)."""


class Gains(Part, frozen=True, kw_only=True):
    """Regulator gains in the drive's units; what is left out stays as it is in the drive."""

    current_p: Gain | None = None
    """Object 0x60F6/1."""
    current_i: Gain | None = None
    """Object 0x60F6/2."""
    velocity_p: Gain | None = None
    """Object 0x60F9/1."""
    velocity_i: Gain | None = None
    """Object 0x60F9/2."""
    position_p: Gain | None = None
    """Object 0x60FB/1."""
    position_i: Gain | None = None
    """Object 0x60FB/2."""
    position_d: Gain | None = None
    """Object 0x60FB/3."""


class EmergencyStopConfig(Part, frozen=True, kw_only=True):
    """An emergency stop contact at a digital input of a drive."""

    input: Annotated[int, Meta(ge=1, le=6)]
    """Number of the digital input."""
    pressed: Literal["low", "high"] = "low"
    """Level of the input while it is pressed; with low, a contact that opens, a broken wire counts as pressed too."""


class DriveConfig(Part, frozen=True, kw_only=True):
    """One drive with its motor, gear, encoder and wheel."""

    node: NodeId
    device: Literal["epos24_5"] = "epos24_5"
    motor: Motor
    encoder_pulses_per_turn: Annotated[int, Meta(ge=16, le=7500)]
    """Pulses; quad counts (qc) are four times as many."""
    position_sensor: Literal["encoder_with_index", "encoder", "hall"] = "encoder_with_index"
    """Sensor on the motor's shaft (object 0x2210/2)."""
    gear_ratio: Positive
    """Motor turns per turn of the gear's output."""
    gear_efficiency: Efficiency = 1.0
    belt_ratio: Positive = 1.0
    """Turns of the gear's output per turn of the wheel."""
    wheel_radius_m: WheelRadius
    direction: Literal[1, -1] = 1
    """1: positive motor speed rolls the wheel forward; -1: the motor is mounted mirrored."""
    mode: Literal["profile_velocity", "velocity", "expiring_position"] = "profile_velocity"
    """Mode of operation for driving: 3 (object 0x60FF) or -2 (object 0x206B)."""
    max_speed_m_s: Positive
    """Limit of the wheel's speed, enforced before encoding and written to the drive where it has an object for it."""
    acceleration_m_s2: Positive
    """Ramp of the drive for a new target velocity, at the wheel's rim (objects 0x6083, 0x6084)."""
    quick_stop_m_s2: Positive
    """Ramp of the drive for quick stop and for faults of class Q (object 0x6085)."""
    continuous_current_a: Annotated[float, Meta(gt=0, le=5)]
    """Current the motor may carry for ever (object 0x6410/1)."""
    output_current_a: Annotated[float, Meta(gt=0, le=10)]
    """Highest current for a short time (object 0x6410/2)."""
    max_following_error_qc: Counts = 2000
    """Difference between demanded and actual position at which the drive faults (object 0x6065)."""
    gains: Gains | None = None
    """Regulator gains; None: as they are in the drive."""
    analog_inputs: bool = False
    """Whether the drive tells the voltages at its analog inputs 1 and 2 in each cycle (TPDO2)."""
    emergency_stop: EmergencyStopConfig | None = None
    """A contact that stops the whole vehicle."""

    @property
    def tells_inputs(self) -> bool:
        """Whether it sends TPDO2, with its inputs."""
        return self.analog_inputs or self.emergency_stop is not None

    @property
    def qc_per_motor_turn(self) -> int:
        """Quad counts per motor turn."""
        return 4 * self.encoder_pulses_per_turn

    @property
    def total_ratio(self) -> float:
        """Motor turns per wheel turn."""
        return self.gear_ratio * self.belt_ratio


class EncoderConfig(Part, frozen=True, kw_only=True):
    """One steering encoder (CiA 406) on the vertical axis of a wheel pair."""

    node: NodeId
    device: Literal["cia406"] = "cia406"
    counts_per_turn: Annotated[int, Meta(ge=1, le=2**32 - 1)]
    total_counts: Annotated[int, Meta(ge=1, le=2**32 - 1)] | None = None
    """Measuring range (object 0x6002); None: the same as counts_per_turn (single-turn)."""
    direction: Literal[1, -1] = 1
    """1: counts grow when the pair turns counter-clockwise."""
    zero_counts: Counts = 0
    """Position value at heading 0."""
    zero_before_counts: Counts | None = None
    """What the place that heading 0 has now said before the last `canhelm encoder zero`, to go back by."""
    calibration: AngleCalibration | None = None
    """What `canhelm calibrate` found; None: the counts are right."""


class BrakeConfig(Part, frozen=True, kw_only=True):
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
    """False: current engages the brake and a loss of power releases it."""
    open_time_s: NotNegative
    close_time_s: NotNegative


class AccelerometerConfig(Part, frozen=True, kw_only=True):
    """An accelerometer with two axes in the robot's plane, each a voltage at an analog input of a drive."""

    drive: str
    """Name of the drive: axis x goes to its analog input 1, axis y to input 2."""
    x_m: float
    """Where it is mounted, forward of the robot's centre."""
    y_m: float
    """Where it is mounted, to the left of the robot's centre."""
    rotation_deg: float = 0.0
    """Direction of its x axis in the robot's frame, counter-clockwise positive."""
    sensitivity_mv_per_m_s2: Positive
    zero_mv: Annotated[float, Meta(ge=0, le=5000)]
    """Voltage without acceleration."""


class PairedSteerGeometry(Part, frozen=True, kw_only=True, tag_field="type", tag="paired_steer"):
    """Geometry and body of a four-wheel robot whose wheels steer in pairs (MAX2D thesis, chapter 4)."""

    type: ClassVar[str] = "paired_steer"
    mass_kg: Positive
    wheelbase_m: Length
    """l: distance between the steering axes of the rear and the front pair."""
    pivot_track_m: Length
    """h: distance between the steering axes of the right and the left side."""
    contact_offset_m: Annotated[float, Meta(ge=0, le=5)]
    """a: from a steering axis outward along the axle to the wheel's contact point."""
    contact_lead_m: Offset
    """b: from a steering axis outward along the heading (front pair forward, rear pair backward)."""
    max_heading_deg: Annotated[float, Meta(gt=0, lt=90)]
    """Steering stops: a pair turns at most this far to each side."""
    wheels: tuple[str, str, str, str]
    """Names of the drives of wheels 1 to 4: rear right, rear left, front left, front right."""
    encoders: tuple[str, str]
    """Names of the steering encoders: rear, front."""
    brakes: tuple[str, str]
    """Names of the steering brakes: rear, front."""
    yaw_inertia_kg_m2: Positive
    centre_of_mass_height_m: NotNegative = 0.0


class OmniWheelGeometry(Part, frozen=True, kw_only=True):
    """Where an omni-wheel rolls; it touches the floor at the foot of the perpendicular from the robot's centre."""

    direction_deg: float
    """Direction of rolling in the robot's frame, counter-clockwise positive."""
    lever_m: Annotated[float, Meta(ge=-20, le=20)]
    """Distance of the rolling line from the centre; positive where it rolls counter-clockwise about the centre."""


class OmniGeometry(Part, frozen=True, kw_only=True, tag_field="type", tag="omni"):
    """Geometry and body of a robot on three or more omni-wheels (Turtle robot's report, appendix A)."""

    type: ClassVar[str] = "omni"
    mass_kg: Positive
    yaw_inertia_kg_m2: Positive
    centre_of_mass_height_m: NotNegative = 0.0
    wheels: Annotated[dict[Name, OmniWheelGeometry], Meta(min_length=3)]
    """By the names of their drives, in the order of the loops."""


BodyGeometry = PairedSteerGeometry | OmniGeometry | CarGeometry | SemitrailerGeometry
"""Those whose mass the drives have to move."""
Geometry = BodyGeometry | DifferentialGeometry | OwnGeometry


class Limits(Part, frozen=True, kw_only=True):
    """What the vehicle may do; the gate before encoding enforces it."""

    speed_m_s: Positive
    """Of the vehicle's centre."""
    acceleration_m_s2: Positive
    """Of the vehicle's centre."""
    wheel_speed_m_s: Positive
    steering_rim_speed_m_s: Positive = 0.1
    """Rim speed of the wheels while a pair turns."""
    heading_deg: Positive = 45.0
    """Steering heading that commands may ask for (within the stops)."""
    heading_tolerance_deg: Positive = 0.2
    """A pair counts as steered when it is closer to its target than this."""
    yaw_rate_deg_s: Positive = 45.0
    """Rate of turn of a vehicle that can turn on the spot."""
    yaw_acceleration_deg_s2: Positive = 45.0
    lateral_acceleration_m_s2: Positive = 2.0
    """Of a vehicle that steers while it rolls; the faster it goes, the less it steers."""
    goal_distance_m: Positive = 100.0
    """Of ``drive to``, and of what an NXT robot drives under feedback: how far away a goal may be."""
    jerk_m_s3: Positive | None = None
    """Of ``drive to``: how fast its acceleration may change; None: at once."""


class TractionConfig(Part, frozen=True, kw_only=True):
    """What the traction loop has to know of drives and wheels. Motor data, mass and inertia stand elsewhere."""

    response_s: NotNegative
    """Time constant with which the drives follow a new target velocity."""
    wheel_inertia_kg_m2: NotNegative
    """Of one wheel alone."""
    rolling_resistance_n: NotNegative
    """Of one wheel, at its rim."""


class Tyre(Part, frozen=True, kw_only=True):
    """Tyre data of the simulation."""

    friction: Positive
    """Coefficient of friction between tyre and floor."""
    slip_stiffness: Positive
    """Longitudinal force per unit of slip ratio, in multiples of the wheel's load."""
    cornering_stiffness_per_rad: Positive
    """Lateral force per radian of slip angle, in multiples of the wheel's load."""
    relaxation_length_m: Positive
    rolling_resistance: Annotated[float, Meta(ge=0, lt=1)] = 0.0
    """Coefficient of rolling resistance."""


class FloorPatch(Part, frozen=True, kw_only=True):
    """A piece of floor with a friction of its own, for a time."""

    shape: Literal["rectangle", "ellipse"] = "rectangle"
    """Of equal length and width: a square, a circle."""
    x_m: float
    """Middle, in the frame where the robot starts at the origin."""
    y_m: float
    length_m: Positive
    """Along x."""
    width_m: Positive
    """Along y."""
    friction: NotNegative
    """Coefficient of friction between tyre and floor on it."""
    from_s: NotNegative = 0.0
    """Time of the simulation at which it appears."""
    until_s: Positive | None = None
    """Time at which it is gone; None: it stays."""


class SimulationConfig(Part, frozen=True, kw_only=True):
    """What only the simulated network needs to know."""

    tyre: Tyre
    supply_voltage_v: Annotated[float, Meta(ge=11, le=24)] = 24.0
    wheel_inertia_kg_m2: Positive
    steering_inertia_kg_m2: Positive = 0.01
    """Of one wheel pair about its steering axes, wheels and coupling belt together."""
    steering_friction_n_m: NotNegative = 0.0
    """Dry friction of one pair's steering axes and coupling belt."""
    brake_holding_torque_n_m: Positive = 10.0
    """Torque at which an engaged brake slips."""
    roller_resistance: Annotated[float, Meta(ge=0, lt=1)] = 0.0
    """Coefficient of rolling resistance of an omni-wheel's rollers, against motion across the wheel."""
    accelerometer_noise_m_s2: NotNegative = 0.0
    """Standard deviation of one reading of the accelerometer."""
    floor: dict[Name, FloorPatch] = field(default_factory=dict)
    """Patches of another friction than the tyre's, the last one on top."""
    sensors: dict[Name, SensorDefects] = field(default_factory=dict)
    """By the names of their encoders; the others are without fault."""
    scanner: SimulatedScannerConfig | None = None
    """Sees the reflectors of `localisation`; None: some program sends bearings."""
    factory: tuple[Name, ...] = ()
    """Drives that are as they left the factory: node id 1, nothing set up."""


class Profile(Part, frozen=True, kw_only=True):
    """A robot: network, drives, bricks, encoders, brakes, accelerometer, vehicle, limits, traction, simulation."""

    schema_version: int
    name: Name
    """Name of the robot; its socket is called after it. Left out: the name of its file."""
    description: str = ""
    setup: Literal["needed", "done", "waived"] = "waived"
    """needed: the robot is not driven before `canhelm setup` was done, or this says waived."""
    network: Network = Network()
    drives: dict[Name, DriveConfig] = field(default_factory=dict)
    bricks: dict[Name, BrickConfig] = field(default_factory=dict)
    """NXT bricks, each with a connection of its own beside the CAN bus."""
    encoders: dict[Name, EncoderConfig] = field(default_factory=dict)
    brakes: dict[Name, BrakeConfig] = field(default_factory=dict)
    accelerometer: AccelerometerConfig | None = None
    vehicle: Geometry | None = None
    limits: Limits
    gamepad: GamepadConfig = GamepadConfig()
    localisation: LocalisationConfig | None = None
    """None: the pose is that of the odometry alone."""
    traction: TractionConfig | None = None
    """None: slip of the wheels is not answered."""
    plausibility: PlausibilityConfig = PlausibilityConfig()
    simulation: SimulationConfig | None = None

    @property
    def motors(self) -> dict[str, NxtMotorConfig]:
        """Motors of all bricks by their names."""
        return {name: motor for brick in self.bricks.values() for name, motor in brick.motors.items()}

    @property
    def wheels(self) -> dict[str, DriveConfig | NxtMotorConfig]:
        """Everything that turns a wheel, on CAN or at a brick, by its name."""
        return {**self.drives, **self.motors}
