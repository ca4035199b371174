"""What the daemon knows of a device: the contract of a drive, an encoder and a brake, in SI.

Another drive type is another folder that fulfils :class:`Drive`; nothing in ``daemon`` names a make.
Wheel quantities are at the rim: metres and metres per second, positive when the wheel rolls forward.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Protocol


class NodeState(StrEnum):
    """Where a node stands in its boot-up, as seen by the master."""

    ABSENT = "absent"
    """Nothing was heard of it, or it was lost."""
    CONFIGURING = "configuring"
    REFUSED = "refused"
    """It answers, but differs from the profile and is not used; the reason is in its status sentence."""
    READY = "ready"
    """Configured, started and guarded."""


class DriveState(StrEnum):
    """State of a drive in the words of CiA 402, short."""

    UNKNOWN = "unknown"
    DISABLED = "disabled"
    ENABLING = "enabling"
    ENABLED = "enabled"
    QUICK_STOP = "quick_stop"
    FAULT = "fault"


class BrakeState(StrEnum):
    """What a brake does, by command and its times."""

    UNKNOWN = "unknown"
    ENGAGED = "engaged"
    RELEASING = "releasing"
    RELEASED = "released"
    ENGAGING = "engaging"


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault that a device reported, or that was noticed about it.

    Attributes:
        source: name of the device (``front_left``).
        node: its node id.
        code: EMCY code, or 0 where there is none (node lost, no answer).
        message: what happened, one sentence.
        remedy: what to do next, one sentence.
    """

    source: str
    node: int
    code: int
    message: str
    remedy: str


class Device(Protocol):
    """What every device on a wire has."""

    name: str
    fault: Fault | None
    reading_time_s: float
    """Loop time of the last reading; ``-inf`` before the first."""

    @property
    def node(self) -> int | None:
        """Its node id; None for what is not on CAN."""
        ...

    @property
    def node_state(self) -> NodeState:
        """Where it stands in its boot-up."""
        ...

    @property
    def status_sentence(self) -> str:
        """What is being done about it, or what is wrong with it, for people."""
        ...

    def require_ready(self) -> None:
        """Raise NodeAbsent or NotReady unless the node is configured, started and guarded."""
        ...

    def status(self) -> dict[str, Any]:
        """Everything about the device for ``canhelm status``; keys carry units."""
        ...


class Drive(Device, Protocol):
    """One drive with its wheel.

    ``command_speed`` only stores the target; ``transmit`` sends it (once a control cycle). Every coroutine raises
    DeviceFault, NotReady, Aborted, NodeAbsent or Timeout, with node, object and remedy.
    """

    position_m: float
    """Distance that the wheel has rolled since the daemon knows the node."""
    speed_m_s: float
    current_a: float
    target_speed_m_s: float

    @property
    def state(self) -> DriveState:
        """What it does."""
        ...

    @property
    def emergency_stop(self) -> str:
        """Why the drive demands an emergency stop: a contact at one of its inputs; empty where it does not."""
        ...

    def command_speed(self, speed_m_s: float) -> None:
        """Take a target speed at the rim for the next ``transmit``."""
        ...

    def transmit(self, deadline_s: float) -> None:
        """Encode and send the target of this cycle; dropped by the bus when it could not be sent by the deadline."""
        ...

    def quick_stop(self) -> None:
        """Command the quick stop at once, outside the cycle (RPDO3), and set the target to zero."""
        ...

    async def insist_on_stop(self) -> None:
        """See that the drive takes its quick stop; tell it by other means where it does not, and raise DeviceFault."""
        ...

    async def enable(self) -> None:
        """Write a zero target, take the drive to Operation Enabled in its driving mode, and return when it is there."""
        ...

    async def disable(self) -> None:
        """Switch the power stage off and return when it is off."""
        ...

    async def reset_fault(self) -> None:
        """Clear a fault with a rising edge of the fault reset bit; returns when the drive has left the fault state."""
        ...

    async def set_current(self, current_a: float) -> None:
        """Switch to current mode (-3) if needed and set the current; zero is written before the mode changes."""
        ...

    async def move_to(self, position_qc: int, *, relative: bool, speed_rpm: float) -> None:
        """Start a profile position move (mode 1) at the motor; ``at_target`` tells when it is done."""
        ...

    async def home(self, method: int) -> None:
        """Start homing (mode 6) by a method of object 0x6098; ``at_target`` tells when it is done."""
        ...

    @property
    def at_target(self) -> bool:
        """True when the last move or homing reached its target (statusword bits 10 and 12)."""
        ...

    async def use_driving_mode(self) -> None:
        """Back to the mode of the profile with a zero target."""
        ...

    def rpm_from_speed(self, speed_m_s: float) -> float:
        """Motor speed in rpm for a rim speed."""
        ...

    def speed_from_rpm(self, speed_rpm: float) -> float:
        """Rim speed for a motor speed in rpm."""
        ...


class SteeringEncoder(Device, Protocol):
    """The heading of one wheel pair."""

    heading_rad: float

    async def preset_zero(self) -> int:
        """Make the present position heading 0 by the device's preset; returns the old position value in counts."""
        ...


class Accelerometer(Protocol):
    """Acceleration of the place where it sits, along its own two axes in the robot's plane."""

    @property
    def acceleration_m_s2(self) -> tuple[float, float] | None:
        """Newest reading; None where there is none, or it is too old."""
        ...

    def status(self) -> dict[str, Any]:
        """Reading for ``canhelm status``."""
        ...


class Brake(Protocol):
    """One brake on a digital output."""

    name: str
    kind: str
    """``"steering"`` or ``"holding"``."""
    drive: str
    """Name of the drive whose output switches it."""
    state: BrakeState

    async def engage(self) -> None:
        """Engage and return after the closing time."""
        ...

    async def release(self) -> None:
        """Release and return after the opening time."""
        ...

    def status(self) -> dict[str, Any]:
        """State for ``canhelm status``."""
        ...
