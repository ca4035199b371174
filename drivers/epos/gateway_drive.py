"""The drive on the serial line: nobody can guard it, so its targets expire by themselves.

No frame of another node reaches its life guarding, and it hears no PDO. It is therefore driven in profile position mode
(maxon EPOS Firmware Specification 9.2) by objects: each cycle sets a target that is only a short time of travel ahead.
When no new one comes the drive comes to rest there by its own ramp. The others, which roll on until their guarding runs
out, may drag it past its target; the limit of its following error (object 0x6065) then switches it off, so that it does
not pull the vehicle back.
"""

from __future__ import annotations

from canhelm.errors import ConfigError, Refused
from drivers.canopen.device import Step
from drivers.canopen.master import Master
from drivers.contract import NodeState
from drivers.epos.drive import EposDrive
from drivers.epos.objects import OBJECTS
from drivers.epos.serial_bus import SerialGatewayBus
from drivers.epos.state_machine import PPM_ABSOLUTE_AT_ONCE, Command
from profiles.schema import DriveConfig

AHEAD_CYCLES = 4
"""Control cycles of travel that a target lies ahead, the way of the ramp not counted."""
LEAD_SHARE = 0.8
"""Of the limit of the following error, what a target may lie ahead of a wheel that does not turn."""
HALT = 0x0100


def ahead_s(speed_m_s: float, cycle_s: float, acceleration_m_s2: float) -> float:
    """Time of travel at a speed that a target lies ahead: some cycles, and the ramp to rest, v / (2 a)."""
    return AHEAD_CYCLES * cycle_s + abs(speed_m_s) / (2.0 * acceleration_m_s2)


class GatewayDrive(EposDrive):
    """An EPOS that is commanded by objects of its own serial line; fulfils ``drivers.contract.Drive``."""

    def __init__(self, master: Master, name: str, config: DriveConfig) -> None:
        super().__init__(master, name, config)
        if not isinstance(master.bus, SerialGatewayBus):
            raise ConfigError(
                f"{self.who}: targets that expire are for the drive on a serial line",
                node=config.node,
                remedy="take mode profile_velocity on a CAN bus",
            )
        self._bus = master.bus
        self._written = -1
        self._written_rpm = -1
        self._streamed = False
        self._qc_per_turn = config.qc_per_motor_turn

    def boot_steps(self) -> tuple[Step, ...]:
        """First of all it has to be the drive on the line: any other one's targets would not expire."""
        return (Step("checking that it is the drive on the serial line", self._check_line), *super().boot_steps())

    async def _check_line(self) -> None:
        found = await self._bus.node_on_line()
        if found != self.node:
            raise Refused(
                f"the drive on {self._bus.name} is node {found}, the profile's gateway is {self.who}",
                node=found,
                remedy="put the cable on that drive, or name the other one as network.gateway in the profile",
            )

    def transmit(self, deadline_s: float) -> None:
        """Write controlword and target of this cycle."""
        if self.node_state is not NodeState.READY:
            return
        driving = self._controlword == Command.ENABLE_OPERATION and self.mode is self.driving_mode
        if driving and self._target_rpm:
            self._stream(deadline_s)
        elif driving and self._streamed:
            self._write_controlword(Command.ENABLE_OPERATION | HALT, deadline_s)
        else:
            self._streamed = False
            self._write_controlword(self._controlword, deadline_s)

    def _stream(self, deadline_s: float) -> None:
        """A target some time of travel ahead, taken at once by a rising edge of the new set-point bit."""
        rpm = self._target_rpm
        self._streamed = True
        if abs(rpm) != self._written_rpm:
            self._write_velocity(abs(rpm), deadline_s)
        travel_s = ahead_s(self.target_speed_m_s, self._period_s, self.config.acceleration_m_s2)
        lead_qc = self._lead_qc(rpm / 60.0 * self._qc_per_turn * travel_s, travel_s)
        target_qc = self._travel.raw_qc + round(lead_qc)
        self._bus.write(OBJECTS["target_position"].index, 0, _int32(target_qc), deadline_s)
        self._write_controlword(Command.ENABLE_OPERATION, deadline_s)
        self._write_controlword(PPM_ABSOLUTE_AT_ONCE, deadline_s)

    def _lead_qc(self, wanted_qc: float, travel_s: float) -> float:
        """How far ahead a target may lie, so that a wheel that is held up does not fall behind too far and trip."""
        moving_qc = abs(self.rpm_from_speed(self.speed_m_s)) / 60.0 * self._qc_per_turn * travel_s
        most_qc = LEAD_SHARE * self.config.max_following_error_qc + moving_qc
        return max(-most_qc, min(wanted_qc, most_qc))

    def _write_velocity(self, rpm: int, deadline_s: float) -> None:
        def written() -> None:
            self._written_rpm = rpm

        value = rpm.to_bytes(4, "little")
        self._bus.write(OBJECTS["profile_velocity"].index, 0, value, deadline_s, on_written=written)

    def _write_controlword(self, controlword: int, deadline_s: float) -> None:
        """Write the controlword unless the drive has it already."""

        def written() -> None:
            self._written = controlword

        if controlword == self._written:
            return
        self._written = -1
        value = int(controlword).to_bytes(2, "little")
        self._bus.write(OBJECTS["controlword"].index, 0, value, deadline_s, on_written=written)

    def quick_stop(self) -> None:
        """Command the quick stop at once, before everything that waits for the line."""
        self._written = -1
        super().quick_stop()

    def on_ready(self) -> None:
        """Nothing is known of what it has been written."""
        super().on_ready()
        self._written = self._written_rpm = -1
        self._streamed = False


def _int32(value: int) -> bytes:
    return (value & 0xFFFF_FFFF).to_bytes(4, "little")
