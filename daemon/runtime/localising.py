"""Localisation of the vehicle: its odometry, corrected by bearings that a scanner or any program sends."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Sequence
from typing import Any, Final, Protocol, runtime_checkable

import msgspec

from canhelm.errors import NotReady, UsageError
from daemon.loops.articulated import ArticulatedVehicle
from daemon.loops.localisation import composed, inverted
from daemon.loops.odometry import Pose
from daemon.loops.path_driving import VehicleReading
from daemon.loops.pose_filter import Correction, FilterNoise, PoseFilter, SeenBearing
from daemon.runtime.events import EventLog
from daemon.runtime.handlers import Handler, Params
from daemon.runtime.poses import place_and_heading
from daemon.runtime.vehicle import Vehicle
from profiles.localisation import LocalisationConfig

FIRST_FIX_S: Final = 5.0
"""How long a path waits for the first fix."""
STALE_S: Final = 1.0
"""Age of the last scan from which the pose is the odometry's alone."""
SOURCE: Final = "localisation"


class Odometry(Protocol):
    """What adds up the wheels' way."""

    pose: Pose


@runtime_checkable
class LocatedVehicle(Protocol):
    """A vehicle that knows where it is by its odometry, and goes on from another pose when it is told."""

    @property
    def odometry(self) -> Odometry:
        """Of the point that ``pose`` means."""
        ...


@runtime_checkable
class TowingVehicle(Protocol):
    """A vehicle that may have trailers."""

    kinematics: ArticulatedVehicle
    reading: VehicleReading


class BearingGiven(msgspec.Struct, forbid_unknown_fields=True):
    """One bearing as a program sends it."""

    bearing_deg: float
    reflector: str | None = None


class Localiser:
    """Keeps a vehicle's pose in the frame of its reflectors.

    Args:
        config: reflectors, scanner, noise.
        vehicle: whose odometry is corrected.
        log: hears where the pose is begun anew.

    Attributes:
        filter: the pose and how well it is known.
        handlers: the methods ``localisation.*``, by name.
    """

    def __init__(self, config: LocalisationConfig, vehicle: Vehicle, log: EventLog) -> None:
        assert isinstance(vehicle, LocatedVehicle)
        self._config, self._vehicle, self._log = config, vehicle, log
        self._odometry = vehicle.odometry
        noise = FilterNoise(
            math.radians(config.bearing_noise_deg), config.way_noise_m, math.radians(config.turn_noise_deg)
        )
        self.filter = PoseFilter({name: (mark.x_m, mark.y_m) for name, mark in config.reflectors.items()}, noise)
        self.handlers: dict[str, Handler] = {"localisation.bearings": self._bearings}
        self._scans = self._used = self._rejected = 0
        self._last_scan_s = -math.inf
        self._located = asyncio.Event()

    async def located(self) -> None:
        """Wait until a scan has told where the vehicle is, and the vehicle has taken it over.

        Raises:
            NotReady: none has within ``FIRST_FIX_S``.
        """
        try:
            async with asyncio.timeout(FIRST_FIX_S):
                await self._located.wait()
        except TimeoutError:
            what = "the vehicle does not know yet where it is: no scan has shown three reflectors"
            remedy = "see that the scanner runs and sees them; `canhelm status --json` has localisation"
            raise NotReady(what, remedy=remedy) from None

    def step(self) -> None:
        """Once a control cycle: follow the odometry."""
        if self.filter.covariance is not None:
            self._located.set()
        pose = self._odometry.pose
        self.filter.move(pose, asyncio.get_running_loop().time(), self._mounting(pose))

    def take(self, scan: Sequence[tuple[float, str | None]], age_s: float) -> Correction:
        """Correct the pose by a scan.

        Args:
            scan: bearings [rad], and the reflectors' names where they are known.
            age_s: time since it was taken.
        """
        now_s = asyncio.get_running_loop().time()
        self.step()
        correction = self.filter.take([SeenBearing(*seen) for seen in scan], now_s - age_s)
        self._odometry.pose = self.filter.pose
        self._scans += 1
        self._used, self._rejected = self._used + correction.used, self._rejected + correction.rejected
        if correction.used:
            self._last_scan_s = now_s
        if correction.anew:
            self._log.add("info", SOURCE, f"the pose is begun anew, {correction.moved_m:.3f} m from where it was")
        return correction

    def _mounting(self, pose: Pose) -> Pose:
        """Pose of the scanner in the frame of the vehicle's pose."""
        scanner = self._config.scanner
        mounted = Pose(scanner.x_m, scanner.y_m, math.radians(scanner.rotation_deg))
        if scanner.on == "vehicle" or not isinstance(self._vehicle, TowingVehicle):
            return mounted
        trailer = self._vehicle.kinematics.poses(pose, self._vehicle.reading.bending_rad)[-1]
        return composed(composed(inverted(pose), trailer), mounted)

    async def _bearings(self, params: Params, lease: str | None) -> dict[str, Any]:
        try:
            given = msgspec.convert(params["bearings"], list[BearingGiven])
        except msgspec.ValidationError as error:
            remedy = 'give a list of {"bearing_deg": ..., "reflector": ...}'
            raise UsageError(f"localisation.bearings: {error}", object="bearings", remedy=remedy) from None
        if not all(math.isfinite(seen.bearing_deg) for seen in given):
            raise UsageError("localisation.bearings: a bearing is not a finite number", object="bearings")
        scan = [(math.radians(seen.bearing_deg), seen.reflector) for seen in given]
        correction = self.take(scan, float(params["age_ms"]) / 1e3)
        return {"used": correction.used, "rejected": correction.rejected, **self.status()}

    def status(self) -> dict[str, Any]:
        """Pose, how well it is known, and how old the last scan is that fitted."""
        pose, covariance = self.filter.pose, self.filter.covariance
        age_s = asyncio.get_running_loop().time() - self._last_scan_s
        return {
            "state": "waiting" if covariance is None else "odometry" if age_s > STALE_S else "fixed",
            **place_and_heading(pose),
            "position_std_m": None if covariance is None else round(covariance.position_m, 4),
            "heading_std_deg": None if covariance is None else round(math.degrees(math.sqrt(covariance.tt)), 3),
            "scan_age_s": round(age_s, 3) if math.isfinite(age_s) else None,
            "scans": self._scans,
            "bearings_used": self._used,
            "bearings_rejected": self._rejected,
        }
