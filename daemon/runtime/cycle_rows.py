"""One row a control cycle: what the wheels were told and did, where the robot was, and which limits were active."""

from __future__ import annotations

import math
from typing import Any

from daemon.runtime.supervisor import Supervisor

WHEEL_COLUMNS = ("commanded_m_s", "speed_m_s", "travel_m", "current_a")


class CycleRows:
    """Makes the rows of one robot.

    Currents have the sign of the wheel: positive where the motor pushes forward.

    Args:
        supervisor: of the robot.

    Attributes:
        head: the columns' names as the first line of a CSV file, with the time that the caller puts in front.
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
        self.head = (",".join([*names, "limits"]) + "\n").encode()
        wheels = ["%.4f,%.4f,%.4f,%.3f"] * len(self._drives)
        self._format = ",".join(["%s", *wheels, *["%.3f"] * len(vehicle.encoders), *["%s"] * len(vehicle.brakes), "%s"])

    def row(self) -> str:
        """This cycle's row, without time and line end."""
        vehicle = self._vehicle
        values: list[Any] = [self._pose()]
        for drive, sign in self._wheels:
            values += (drive.target_speed_m_s, drive.speed_m_s, drive.position_m, sign * drive.current_a)
        values += [math.degrees(encoder.heading_rad) for encoder in vehicle.encoders]
        values += [str(brake.state) for brake in vehicle.brakes]
        values.append(" ".join(self._supervisor.active_limits))
        return self._format % tuple(values)

    def _pose(self) -> str:
        odometry = self._vehicle.status().get("odometry")
        return "{x_m},{y_m},{yaw_deg}".format(**odometry) if odometry else ",,"
