"""Traction of a robot whose wheels steer in pairs, while both pairs are locked: slip by all wheels together.

Two signals tell it. Of the least-squares motion that fits all four wheels best, each wheel's residual is what no motion
of the body explains; it tells one wheel from the others at once, but is silent where all slip alike. The motors'
currents (:mod:`daemon.loops.slip_observer`) tell that, too, as long as the tyres do not scrub: in a sharp curve wheels
that are dragged sideways need forces that no model of rolling knows, and residuals are all there is. A wheel that slips
has its own limit of acceleration: it may be little faster or slower than the floor, until it grips and is let go at a
limited rate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from daemon.loops.geometry import FRONT, REAR, TURN_SIGN, WHEELS_OF_PAIR, PerPair, solve_turning
from daemon.loops.least_squares import least_squares
from daemon.loops.slip_observer import Body, Observed, RimDrive, Row, SlipObserver, rim_drive
from daemon.loops.wheel_grip import WheelGrip, WheelGripRecord
from profiles.schema import PairedSteerGeometry, Profile

RESIDUAL_M_S: Final = 0.05
"""Residual of a wheel that is slip for certain; in a curve the wheels' own mismatch leaves less."""
SCRUB_RAD: Final = math.radians(1.0)
"""Angle between the direction of a wheel and its motion beyond which currents are no sign of slip."""


@dataclass(frozen=True, slots=True)
class PairedTractionRecord:
    """The terms of one step.

    Attributes:
        residual_m_s: of each wheel, against the least-squares motion.
        observed: by the currents; without meaning in a sharp curve.
        by_currents: whether they count.
        slipping: for each wheel, by either signal.
        grip: speeds to command, and the limit of each wheel.
    """

    residual_m_s: tuple[float, ...]
    observed: Observed
    by_currents: bool
    slipping: tuple[bool, ...]
    grip: WheelGripRecord


class PairedTraction:
    """The loop for one pair of locked headings.

    Args:
        geometry: the robot.
        drives: of wheels 1 to 4.
        heading_rad: where the rear and the front pair are locked.
    """

    def __init__(self, geometry: PairedSteerGeometry, drives: Sequence[RimDrive], heading_rad: PerPair) -> None:
        self._rows, self._still = _rows(geometry, heading_rad)
        body = Body(geometry.mass_kg, geometry.yaw_inertia_kg_m2)
        self._observer = SlipObserver(body, drives, self._rows, self._still)
        self._grip = WheelGrip(len(self._rows))
        mismatch = solve_turning(geometry, *heading_rad, 1.0).mismatch_rad
        self._by_currents = max(map(abs, mismatch)) <= SCRUB_RAD

    def step(
        self, wanted: Sequence[float], wheel_speeds: Sequence[float], currents_a: Sequence[float], dt: float
    ) -> PairedTractionRecord:
        """One cycle.

        Args:
            wanted: rim speeds of wheels 1 to 4 [m/s].
            wheel_speeds: measured [m/s].
            currents_a: of the motors, positive where they drive forward.
            dt: time since the last step [s].
        """
        seen = self._observer.step(wheel_speeds, currents_a, dt)
        residuals = self._residuals(wheel_speeds)
        by_currents = seen.slipping if self._by_currents else (False,) * len(self._rows)
        slipping = tuple(
            slips or abs(residual) > RESIDUAL_M_S for slips, residual in zip(by_currents, residuals, strict=True)
        )
        fitted = tuple(speed - residual for speed, residual in zip(wheel_speeds, residuals, strict=True))
        grip = self._grip.step(wanted, seen.ground_m_s if self._by_currents else fitted, slipping, dt)
        return PairedTractionRecord(residuals, seen, self._by_currents, slipping, grip)

    def _residuals(self, wheel_speeds: Sequence[float]) -> tuple[float, ...]:
        if not all(map(math.isfinite, wheel_speeds)):
            return (0.0,) * len(self._rows)
        x, y, turn = least_squares([*self._rows, *self._still], [*wheel_speeds, *[0.0] * len(self._still)])
        return tuple(
            speed - (row[0] * x + row[1] * y + row[2] * turn)
            for row, speed in zip(self._rows, wheel_speeds, strict=True)
        )


def rim_drives(profile: Profile) -> tuple[RimDrive, ...]:
    """The drives of wheels 1 to 4; none where the profile answers no slip, or readings come one by one."""
    traction, vehicle = profile.traction, profile.vehicle
    if traction is None or not isinstance(vehicle, PairedSteerGeometry) or not profile.network.synchronous:
        return ()
    return tuple(rim_drive(profile.drives[name], traction) for name in vehicle.wheels)


def _rows(geometry: PairedSteerGeometry, heading_rad: PerPair) -> tuple[list[Row], list[Row]]:
    """Of wheels 1 to 4, and across each pair midway between its contact points, where nothing moves."""
    rows: list[Row] = []
    still: list[Row] = []
    for pair, end in ((REAR, -1.0), (FRONT, 1.0)):
        cos, sin = math.cos(heading_rad[pair]), math.sin(heading_rad[pair])
        axis_m = end * geometry.wheelbase_m / 2
        arm_m = geometry.pivot_track_m / 2 * cos + geometry.contact_offset_m
        rows += [(cos, sin, axis_m * sin + TURN_SIGN[wheel] * arm_m) for wheel in WHEELS_OF_PAIR[pair]]
        still.append((-sin, cos, axis_m * cos + end * geometry.contact_lead_m))
    return rows, still
