"""One row a control cycle: what the wheels were told and did, where the robot was, errors beside a path, limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from daemon.runtime.following import COLUMNS
from daemon.runtime.supervisor import Supervisor
from daemon.runtime.vehicle_view import followed

_NO_ERRORS = ("",) * len(COLUMNS)
WHEEL_COLUMNS = ("commanded_m_s", "speed_m_s", "travel_m", "current_a")


class CycleRows:
    """Makes the rows of one robot: their values in each cycle, their text when there is time for it.

    Currents have the sign of the wheel: positive where the motor pushes forward.

    Args:
        supervisor: of the robot.

    Attributes:
        head: the columns' names as the first line of a CSV file, with the time in front.
    """

    def __init__(self, supervisor: Supervisor) -> None:
        vehicle, configs = supervisor.vehicle, supervisor.vehicle.profile.drives
        self._supervisor = supervisor
        self._vehicle = vehicle
        self._drives = (*vehicle.drives, *vehicle.aside)
        signs = [configs[drive.name].direction if drive.name in configs else 1 for drive in self._drives]
        self._wheels = list(zip(self._drives, signs, strict=True))
        names = ["time_s", "x_m", "y_m", "yaw_deg"]
        names += [f"{drive.name}.{column}" for drive in self._drives for column in WHEEL_COLUMNS]
        names += [f"{encoder.name}.heading_deg" for encoder in vehicle.encoders]
        names += [f"{brake.name}.brake" for brake in vehicle.brakes]
        self._follows = "drive.path" in vehicle.methods
        names += [f"path.{column}" for column in COLUMNS] if self._follows else []
        self.head = (",".join([*names, "limits"]) + "\n").encode()
        wheels = ["%.4f,%.4f,%.4f,%.3f"] * len(self._drives)
        headings, brakes = ["%.3f"] * len(vehicle.encoders), ["%s"] * len(vehicle.brakes)
        errors = ["%s"] * len(COLUMNS) if self._follows else []
        self._format = ",".join(["%.4f", "%s", "%s", "%s", *wheels, *headings, *brakes, *errors, "%s\n"])

    def values(self) -> list[Any]:
        """This cycle's row, without its time."""
        place = self._vehicle.place
        values: list[Any] = ["", "", ""] if place is None else [place.x_m, place.y_m, math.degrees(place.yaw_rad)]
        for drive, sign in self._wheels:
            values += (drive.target_speed_m_s, drive.speed_m_s, drive.position_m, sign * drive.current_a)
        values += [math.degrees(encoder.heading_rad) for encoder in self._vehicle.encoders]
        values += [brake.state for brake in self._vehicle.brakes]
        if self._follows:
            values += self._errors()
        values.append(" ".join(self._supervisor.active_limits))
        return values

    def _errors(self) -> Sequence[float | str]:
        """Those beside a path, and their limits; empty where there are none."""
        motion = followed(self._supervisor.motions.values())
        following = motion.following() if motion else None
        if following is None:
            return _NO_ERRORS
        return ["" if value is None else value for value in (*following.errors(), *following.error_limits())]

    def text(self, time_s: float, values: Sequence[Any]) -> bytes:
        """The line of the CSV file for a row's values."""
        place = values[:3] if values[0] == "" else map(_rounded, values[:3], (4, 4, 3))
        return (self._format % (time_s, *place, *values[3:])).encode()


def _rounded(value: float, digits: int) -> float:
    return round(value, digits) + 0.0  # not -0.0
