"""A CiA 406 encoder on the vertical axis of a wheel pair."""

from __future__ import annotations

import math
import struct
from typing import Any

from drivers.canopen.configuration import Configuration
from drivers.canopen.device import CanopenDevice, Step
from drivers.canopen.master import Master
from drivers.canopen.pdo import ON_SYNC, tpdo_cob_id, tpdo_settings
from drivers.contract import Fault
from drivers.encoder.objects import OBJECTS, POSITION_ERROR
from profiles.schema import EncoderConfig

POSITION = struct.Struct("<I")
PROFILE_406, PROFILE_MASK = 0x0196, 0xFFFF
_unpack_position = POSITION.unpack


def heading_of(counts: int, config: EncoderConfig) -> float:
    """Heading in rad of a position value, corrected where the encoder is calibrated."""
    sensed = sensed_heading(counts, config)
    if config.calibration is None:
        return sensed
    return math.radians(config.calibration.correct(math.degrees(sensed)))


def sensed_heading(counts: int, config: EncoderConfig) -> float:
    """What a position value says [rad]: its distance from the zero position, wrapped to half a range on each side."""
    span = config.total_counts or config.counts_per_turn
    half = span // 2
    from_zero = (counts - config.zero_counts + half) % span - half
    return config.direction * from_zero * (2.0 * math.pi / config.counts_per_turn)


class Cia406Encoder(CanopenDevice):
    """One steering encoder; fulfils ``drivers.contract.SteeringEncoder``.

    Its TPDO2 comes after each SYNC; TPDO1, which it would send by its own timer, is silenced.

    Args:
        master: the master of its bus.
        name: its name in the profile.
        config: its part of the profile.

    Attributes:
        counts: last position value.
        heading_rad: the pair's heading, counter-clockwise positive.
    """

    kind = "cia406"

    def __init__(self, master: Master, name: str, config: EncoderConfig) -> None:
        super().__init__(master, name, config.node)
        self.config = config
        self.counts = config.zero_counts
        self.heading_rad = 0.0
        master.subscribe(tpdo_cob_id(1, config.node), self._on_position)
        master.subscribe(tpdo_cob_id(2, config.node), self._on_tpdo2)

    def _on_tpdo2(self, can_id: int, data: bytes, timestamp: float) -> None:
        self._on_position(can_id, data, timestamp)
        if self.on_reading is not None:
            self.on_reading(self.node)

    def _on_position(self, can_id: int, data: bytes, timestamp: float) -> None:
        """A position value in TPDO1 or TPDO2; an encoder sends TPDO1 once when it is started."""
        if len(data) != POSITION.size:
            self.master.counters.malformed += 1
            return
        (counts,) = _unpack_position(data)
        if counts != self.counts:
            self.counts = counts
            self.heading_rad = heading_of(counts, self.config)
        self.reading_time_s = timestamp

    async def preset_zero(self) -> int:
        """Make the present position heading 0 by the encoder's preset.

        Returns:
            The position value before, in counts.

        Raises:
            NotReady, NodeAbsent, Timeout, Aborted.
        """
        self.require_ready()
        old = await self.sdo.read_int(OBJECTS["position_value"])
        await self.sdo.write(OBJECTS["preset_value"], self.config.zero_counts)
        return old

    # --- boot-up -------------------------------------------------------------------------------------------------

    def boot_steps(self) -> tuple[Step, ...]:
        """Configuration in pre-operational."""
        configuration = Configuration(self.sdo, self.who, self.master.pacing)

        async def write_guarding() -> None:
            network = self.master.network
            await configuration.write(
                [
                    (OBJECTS["life_time_factor"], 0),
                    (OBJECTS["guard_time"], network.guard_time_ms),
                    (OBJECTS["life_time_factor"], network.life_time_factor),
                ]
            )

        async def write_pdos() -> None:
            await configuration.write([(OBJECTS["tpdo1_event_timer"], 0), (OBJECTS["cyclic_timer"], 0)])
            await configuration.write(tpdo_settings(OBJECTS, 2, self.node, ON_SYNC))
            mapped = OBJECTS["position_value"].mapping
            await configuration.expect(OBJECTS["tpdo2_mapping_entry_1"], mapped, "map the position value to TPDO2")

        return (
            Step("checking its identity and resolution", lambda: self._check(configuration)),
            Step("setting up guarding", write_guarding),
            Step("mapping its PDOs", write_pdos),
            Step("reading everything back", configuration.verify),
        )

    async def _check(self, configuration: Configuration) -> None:
        other = "check the node ids: another kind of device stands on this one"
        await configuration.expect(OBJECTS["device_type"], PROFILE_406, other, PROFILE_MASK)
        resolution = "correct counts_per_turn in the profile, or the encoder's scaling (0x6000 bit 2, 0x6001)"
        scaled = await self.sdo.read_int(OBJECTS["operating_parameters"]) & 4
        units = OBJECTS["measuring_units_per_turn" if scaled else "single_turn_resolution"]
        await configuration.expect(units, self.config.counts_per_turn, resolution)

    def start_steps(self) -> tuple[Step, ...]:
        """Nothing: the first reading comes with the next SYNC."""
        return ()

    def on_ready(self) -> None:
        """An old fault is gone; one that is still there comes again as an emergency message."""
        self.fault = None

    def on_lost(self, fault: Fault) -> None:
        """The last heading stays; ``reading_time_s`` tells how old it is."""

    def on_emcy(self, code: int, register: int, vendor: bytes) -> Fault | None:
        """An alarm: the heading cannot be trusted until the encoder takes it back with code 0."""
        if code == 0:
            self.fault = None
            return None
        alarm = OBJECTS["alarms"]
        words = "position error" if code == POSITION_ERROR else "an alarm"
        self.fault = self.make_fault(
            code, f"{self.who} reports {words} (0x{code:04X}, error register 0x{register:02X})", alarm.cure
        )
        return self.fault

    async def before_close(self) -> None:
        """End life guarding, so that the encoder does not report its master lost."""
        await self.sdo.write(OBJECTS["life_time_factor"], 0)

    def status(self) -> dict[str, Any]:
        """Everything about the encoder."""
        return super().status() | {
            "heading_deg": round(math.degrees(self.heading_rad), 3),
            "sensed_deg": round(math.degrees(sensed_heading(self.counts, self.config)), 4),
            "position_counts": self.counts,
        }
