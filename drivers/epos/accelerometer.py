"""An analog accelerometer at the analog inputs 1 and 2 of an EPOS 24/5 (objects 0x207C/1 and 0x207C/2, TPDO2)."""

from __future__ import annotations

from typing import Any

from drivers.epos.drive import EposDrive
from profiles.schema import AccelerometerConfig

STALE_S = 0.05
"""A reading that lags the drive's other readings by more than this is none."""


class AnalogAccelerometer:
    """Fulfils ``drivers.contract.Accelerometer``.

    Args:
        config: its voltages; its mounting is the loops' to use.
        drive: whose inputs it is wired to.
    """

    def __init__(self, config: AccelerometerConfig, drive: EposDrive) -> None:
        self._zero_mv = config.zero_mv
        self._per_mv = 1.0 / config.sensitivity_mv_per_m_s2
        self._drive = drive

    @property
    def acceleration_m_s2(self) -> tuple[float, float] | None:
        """Newest reading along the sensor's axes; None where there is none, or it is too old."""
        drive = self._drive
        if drive.reading_time_s - drive.analog_time_s > STALE_S:
            return None
        x_mv, y_mv = drive.analog_mv
        return (x_mv - self._zero_mv) * self._per_mv, (y_mv - self._zero_mv) * self._per_mv

    def status(self) -> dict[str, Any]:
        """For ``canhelm status``."""
        reading = self.acceleration_m_s2
        return {"drive": self._drive.name, "acceleration_m_s2": reading and [round(value, 3) for value in reading]}
