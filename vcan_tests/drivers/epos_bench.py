"""A bench for the simulated nodes: one shaft without a vehicle, and a master that knows nothing but raw frames."""

from __future__ import annotations

import asyncio
import struct
from math import tau

from drivers.bus.contract import RTR_FLAG
from drivers.simulated.bus import SimulatedBus
from drivers.simulated.epos import SimulatedEpos
from drivers.simulated.world import STEP_S, Axis
from profiles.schema import DriveConfig, Motor

MOTOR = Motor(
    nominal_voltage_v=24.0,
    nominal_speed_rpm=10400.0,
    nominal_torque_n_m=0.0482,
    nominal_current_a=2.64,
    torque_constant_n_m_a=0.02,
    resistance_ohm=1.2,
    rotor_inertia_kg_m2=1e-5,
)
LOAD_KG_M2 = 9e-5

SHUTDOWN, SWITCH_ON, ENABLE, QUICK_STOP, DISABLE_VOLTAGE, RESET = 0x06, 0x07, 0x0F, 0x02, 0x00, 0x80
SWITCH_ON_DISABLED, READY_TO_SWITCH_ON, SWITCHED_ON, REFRESH = 0x140, 0x121, 0x123, 0x4123
OPERATION_ENABLED, QUICK_STOP_ACTIVE, FAULT, FAULT_REACTION = 0x137, 0x117, 0x108, 0x11F
START, STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 1, 2, 128, 129, 130
TARGET_REACHED, BIT_12, BIT_13, REFERENCED = 0x0400, 0x1000, 0x2000, 0x8000
HOMING, VELOCITY_PROFILE, POSITION_PROFILE, POSITION, VELOCITY, CURRENT = 6, 3, 1, -1, -2, -3


def drive_config(node: int = 1) -> DriveConfig:
    """A drive that turns an inertia and nothing else."""
    return DriveConfig(
        node=node,
        motor=MOTOR,
        encoder_pulses_per_turn=500,
        gear_ratio=14.0,
        wheel_radius_m=0.1,
        max_speed_m_s=2.0,
        acceleration_m_s2=1.0,
        quick_stop_m_s2=1.0,
        continuous_current_a=2.0,
        output_current_a=5.0,
    )


class BenchWorld:
    """A rotor with a load on it; ``blocked`` holds it, ``heading`` is the heading of every wheel pair."""

    def __init__(self) -> None:
        self.axes = {"bench": Axis()}
        self.blocked = False
        self.heading = 0.0
        self.brakes: dict[str, bool] = {}
        self._steps: int | None = None

    @property
    def moving(self) -> bool:
        """Whether the shaft turns."""
        return self.axes["bench"].speed_rad_s != 0.0

    def advance(self, now_s: float) -> None:
        """Integrate up to ``now_s``."""
        due = int(now_s / STEP_S + 1e-6)
        for _ in range(0 if self._steps is None else due - self._steps):
            self._step(self.axes["bench"])
        self._steps = due if self._steps is None else max(due, self._steps)

    def _step(self, axis: Axis) -> None:
        source = axis.torque_source
        axis.current_a = source.current_demand(axis.speed_rad_s, axis.position_rad, STEP_S) if source else 0.0
        if self.blocked:
            axis.speed_rad_s = 0.0
            return
        torque = axis.current_a * MOTOR.torque_constant_n_m_a
        axis.speed_rad_s += torque / (MOTOR.rotor_inertia_kg_m2 + LOAD_KG_M2) * STEP_S
        axis.position_rad += axis.speed_rad_s * STEP_S

    def heading_rad(self, pair: str) -> float:
        """The heading that the test set."""
        return self.heading

    def set_brake(self, name: str, engaged: bool) -> None:
        """Note it."""
        self.brakes[name] = engaged


class RawMaster:
    """Sends frames and keeps what it hears."""

    def __init__(self, medium: SimulatedBus) -> None:
        self.port = medium.port("raw master")
        self.port.receiver = self._hear
        self.heard: list[tuple[int, bytes]] = []
        self.times_s: list[float] = []

    def _hear(self, can_id: int, data: bytes, timestamp: float) -> None:
        self.heard.append((can_id, data))
        self.times_s.append(timestamp)

    def of(self, can_id: int) -> list[bytes]:
        """Data of all frames heard with an identifier since the last request."""
        return [data for heard_id, data in self.heard if heard_id == can_id]

    async def send(self, can_id: int, text: str = "", settle_s: float = 0.001) -> None:
        """Send data given in hexadecimal and let the bus settle."""
        self.port.send(can_id, bytes.fromhex(text))
        await asyncio.sleep(settle_s)

    async def nmt(self, command: int, node: int) -> None:
        """Send an NMT command."""
        await self.send(0x000, f"{command:02x}{node:02x}")

    async def guard(self, node: int) -> list[bytes]:
        """Send a guard request; the answers."""
        before = len(self.of(0x700 + node))
        await self.send(0x700 + node | RTR_FLAG)
        return self.of(0x700 + node)[before:]

    async def ask(self, node: int, request: bytes) -> bytes:
        """One SDO request and its answer."""
        await self.send(0x600 + node, request.hex())
        return self.of(0x580 + node)[-1]

    async def read(self, node: int, index: int, sub: int = 0) -> int:
        """An object of up to 4 bytes as an unsigned number."""
        answer = await self.ask(node, struct.pack("<BHBI", 0x40, index, sub, 0))
        assert answer[0] & 0xE3 == 0x43, answer.hex()
        return int.from_bytes(answer[4 : 8 - (answer[0] >> 2 & 3)], "little")

    async def write(self, node: int, index: int, sub: int, data: bytes) -> int:
        """Write up to 4 bytes; returns 0 or the abort code."""
        answer = await self.ask(node, struct.pack("<BHB4s", 0x23 | (4 - len(data)) << 2, index, sub, data))
        return 0 if answer[0] == 0x60 else int.from_bytes(answer[4:8], "little")

    async def u8(self, node: int, index: int, sub: int, value: int) -> int:
        """Write one byte."""
        return await self.write(node, index, sub, value.to_bytes(1, "little", signed=value < 0))

    async def u16(self, node: int, index: int, sub: int, value: int) -> int:
        """Write two bytes."""
        return await self.write(node, index, sub, value.to_bytes(2, "little", signed=value < 0))

    async def u32(self, node: int, index: int, sub: int, value: int) -> int:
        """Write four bytes."""
        return await self.write(node, index, sub, value.to_bytes(4, "little", signed=value < 0))


class Bench:
    """A simulated EPOS on a bench with its master."""

    def __init__(self, node: int = 1) -> None:
        self.medium = SimulatedBus()
        self.world = BenchWorld()
        self.node = node
        port = self.medium.port("epos")
        self.epos = SimulatedEpos(port, drive_config(node), self.world.axes["bench"], self.world, 0.05, seed=1)
        self.master = RawMaster(self.medium)

    @classmethod
    async def booted(cls, node: int = 1) -> Bench:
        """A bench whose drive has power and has sent its boot-up message."""
        bench = cls(node)
        bench.watch()
        bench.epos.power_on()
        await asyncio.sleep(0.06)
        return bench

    def watch(self) -> None:
        """Look at the world every 10 ms, as a network does."""
        loop = asyncio.get_running_loop()
        self.world.advance(loop.time())
        loop.call_later(0.01, self.watch)

    @property
    def rpm(self) -> float:
        """True speed of the shaft."""
        self.world.advance(asyncio.get_running_loop().time())
        return self.world.axes["bench"].speed_rad_s * 60.0 / tau

    @property
    def qc(self) -> float:
        """True angle of the shaft in quad counts."""
        self.world.advance(asyncio.get_running_loop().time())
        return self.world.axes["bench"].position_rad / tau * 2000.0

    async def u8(self, index: int, sub: int, value: int) -> int:
        """Write one byte to the drive."""
        return await self.master.u8(self.node, index, sub, value)

    async def u16(self, index: int, sub: int, value: int) -> int:
        """Write two bytes to the drive."""
        return await self.master.u16(self.node, index, sub, value)

    async def u32(self, index: int, sub: int, value: int) -> int:
        """Write four bytes to the drive."""
        return await self.master.u32(self.node, index, sub, value)

    async def read(self, index: int, sub: int = 0) -> int:
        """Read an object of the drive, unsigned."""
        return await self.master.read(self.node, index, sub)

    async def control(self, *words: int) -> None:
        """Write controlwords, one after the other."""
        for word in words:
            assert await self.u16(0x6040, 0, word) == 0

    async def status(self) -> int:
        """The whole statusword."""
        return await self.read(0x6041)

    async def state(self) -> int:
        """The state bits of the statusword."""
        return await self.status() & 0x417F

    async def enable(self, mode: int) -> None:
        """Set the mode and enable, through Refresh."""
        assert await self.u8(0x6060, 0, mode) == 0
        await self.control(SHUTDOWN, SWITCH_ON, ENABLE)
        await asyncio.sleep(0.01)

    async def position(self) -> int:
        """Position actual value, signed."""
        raw = await self.read(0x6064)
        return raw - (raw >> 31 << 32)

    def emergencies(self) -> list[int]:
        """Codes of the EMCYs heard."""
        return [int.from_bytes(data[:2], "little") for data in self.master.of(0x80 + self.node)]


async def enabled(mode: int) -> Bench:
    bench = await Bench.booted()
    await bench.enable(mode)
    return bench
