"""What the NXT replies where all went well; a request that is not here gets a status and nothing else."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

from drivers.nxt import requests
from drivers.nxt.layout import NAME_SIZE, Telegram, as_text, require_at_most, require_text
from drivers.nxt.requests import MAX_LOW_SPEED, MAX_MESSAGE


@dataclass(frozen=True, slots=True)
class OutputState(Telegram):
    """What a motor was told, what it does, and its counters in degrees of its output shaft.

    ``tacho_deg`` is the counter that limits are measured by, ``block_deg`` and ``rotation_deg`` are those that
    ResetMotorPosition zeroes.
    """

    OPCODE: ClassVar[int] = 0x06
    LAYOUT: ClassVar[str] = "BbBBbBIiii"
    port: int
    power: int
    mode: int
    regulation: int
    turn_ratio: int
    run_state: int
    tacho_limit_deg: int
    tacho_deg: int
    block_deg: int
    rotation_deg: int


@dataclass(frozen=True, slots=True)
class InputValues(Telegram):
    """A reading of a sensor; ``normalised`` is 0 to 1023, ``scaled`` follows the sensor mode."""

    OPCODE: ClassVar[int] = 0x07
    LAYOUT: ClassVar[str] = "B??BBHHhh"
    port: int
    valid: bool
    calibrated: bool
    sensor_type: int
    sensor_mode: int
    raw: int
    normalised: int
    scaled: int
    calibrated_value: int


@dataclass(frozen=True, slots=True)
class BatteryLevel(Telegram):
    """Voltage of the battery."""

    OPCODE: ClassVar[int] = 0x0B
    LAYOUT: ClassVar[str] = "H"
    voltage_mv: int


@dataclass(frozen=True, slots=True)
class SleepLimit(Telegram):
    """Time without a keep-alive after which the brick switches itself off; 0 for never."""

    OPCODE: ClassVar[int] = 0x0D
    LAYOUT: ClassVar[str] = "I"
    sleep_limit_ms: int


@dataclass(frozen=True, slots=True)
class LowSpeedStatus(Telegram):
    """How many bytes of a digital sensor are ready."""

    OPCODE: ClassVar[int] = 0x0E
    LAYOUT: ClassVar[str] = "B"
    bytes_ready: int


@dataclass(frozen=True, slots=True)
class LowSpeedData(Telegram):
    """What a digital sensor has answered."""

    OPCODE: ClassVar[int] = 0x10
    data: bytes

    def __post_init__(self) -> None:
        require_at_most(self.data, MAX_LOW_SPEED)

    def pack(self) -> bytes:
        return bytes((len(self.data),)) + self.data.ljust(MAX_LOW_SPEED, b"\0")

    @classmethod
    def unpack(cls, payload: bytes) -> LowSpeedData:
        if len(payload) != 1 + MAX_LOW_SPEED or payload[0] > MAX_LOW_SPEED:
            raise ValueError("an answer of a sensor has its size and 16 bytes")
        return cls(payload[1 : 1 + payload[0]])


@dataclass(frozen=True, slots=True)
class CurrentProgram(Telegram):
    """The running program."""

    OPCODE: ClassVar[int] = 0x11
    LAYOUT: ClassVar[str] = f"{NAME_SIZE}s"
    file_name: str

    def __post_init__(self) -> None:
        require_text(self.file_name, NAME_SIZE)


@dataclass(frozen=True, slots=True)
class Message(Telegram):
    """A message of the running program, without its final zero."""

    OPCODE: ClassVar[int] = 0x13
    mailbox: int
    data: bytes

    def __post_init__(self) -> None:
        require_at_most(self.data, MAX_MESSAGE)

    def pack(self) -> bytes:
        return bytes((self.mailbox, len(self.data) + 1)) + self.data.ljust(MAX_MESSAGE + 1, b"\0")

    @classmethod
    def unpack(cls, payload: bytes) -> Message:
        if len(payload) != MAX_MESSAGE + 3 or not 1 <= payload[1] <= MAX_MESSAGE + 1:
            raise ValueError("a message that was read has its size and 59 bytes")
        return cls(payload[0], payload[2 : 1 + payload[1]])


@dataclass(frozen=True, slots=True)
class FirmwareVersion(Telegram):
    """Versions of protocol and firmware, minor before major as on the wire."""

    OPCODE: ClassVar[int] = 0x88
    LAYOUT: ClassVar[str] = "BBBB"
    protocol_minor: int
    protocol_major: int
    firmware_minor: int
    firmware_major: int


@dataclass(frozen=True, slots=True)
class DeviceInfo(Telegram):
    """Name, Bluetooth address (six bytes as ``00:16:53:..``), strength of four signals, free memory."""

    OPCODE: ClassVar[int] = 0x9B
    name: str
    address: str
    signal: bytes
    free_flash: int

    def __post_init__(self) -> None:
        require_text(self.name, 15)

    def pack(self) -> bytes:
        name = self.name.encode("latin-1").ljust(15, b"\0")
        address = bytes.fromhex(self.address.replace(":", "")) + b"\0"
        if len(address) != 7 or len(self.signal) != 4:
            raise ValueError(f"{self}: the address has six bytes, the signal four")
        return name + address + self.signal + self.free_flash.to_bytes(4, "little")

    @classmethod
    def unpack(cls, payload: bytes) -> DeviceInfo:
        if len(payload) != 30:
            raise ValueError(f"device info has 30 bytes, not {len(payload)}")
        return cls(
            as_text(payload[:15]),
            payload[15:21].hex(":"),
            payload[22:26],
            int.from_bytes(payload[26:], "little"),
        )


REPLIES: Final[dict[type[Telegram], type[Telegram]]] = {
    requests.GetOutputState: OutputState,
    requests.GetInputValues: InputValues,
    requests.GetBatteryLevel: BatteryLevel,
    requests.KeepAlive: SleepLimit,
    requests.LowSpeedGetStatus: LowSpeedStatus,
    requests.LowSpeedRead: LowSpeedData,
    requests.GetCurrentProgram: CurrentProgram,
    requests.MessageRead: Message,
    requests.GetFirmwareVersion: FirmwareVersion,
    requests.GetDeviceInfo: DeviceInfo,
}
"""What the reply to a request carries, by the request's class."""
BY_OPCODE: Final = {reply.OPCODE: reply for reply in REPLIES.values()}
"""The same by opcode; no opcode stands for two things."""
