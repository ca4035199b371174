"""Which loops a profile runs."""

from __future__ import annotations

from canhelm.errors import ConfigError
from daemon.runtime.car_vehicle import CarVehicle
from daemon.runtime.differential_vehicle import DifferentialVehicle
from daemon.runtime.omni_vehicle import OmniVehicle
from daemon.runtime.own_vehicle import OwnKindVehicle
from daemon.runtime.paired_steer_vehicle import PairedSteerVehicle
from daemon.runtime.semitrailer_vehicle import SemitrailerVehicle
from daemon.runtime.vehicle import BareDrives, Vehicle
from drivers.contract import Brake, Drive, SteeringEncoder
from drivers.devices import Devices
from profiles.bricks import DifferentialGeometry
from profiles.own_vehicle import OwnGeometry
from profiles.schema import OmniGeometry, PairedSteerGeometry, Profile
from profiles.steered import CarGeometry, SemitrailerGeometry


def make_vehicle(profile: Profile, devices: Devices) -> Vehicle:
    """The vehicle of a profile on its devices. Raises ConfigError for a type that has no loops here."""
    vehicle = _vehicle_of(profile, devices)
    vehicle.aside = tuple(drive for drive in devices.drives.values() if drive not in vehicle.drives)
    return vehicle


def _vehicle_of(profile: Profile, devices: Devices) -> Vehicle:
    geometry = profile.vehicle
    if geometry is None:
        return BareDrives(profile, tuple(devices.drives.values()))
    if isinstance(geometry, PairedSteerGeometry):
        return PairedSteerVehicle(profile, *_in_order(devices, geometry))
    if isinstance(geometry, OmniGeometry):
        return OmniVehicle(profile, tuple(devices.drives[name] for name in geometry.wheels), devices.accelerometer)
    if isinstance(geometry, CarGeometry):
        axle = geometry.steering
        wheels = tuple(devices.drives[name] for name in geometry.wheels)
        return CarVehicle(profile, wheels, devices.drives[axle.drive], devices.encoders[axle.encoder])
    if isinstance(geometry, SemitrailerGeometry):
        drives, encoders = devices.drives, devices.encoders
        angles = (encoders[geometry.steering.encoder], encoders[geometry.trailer.encoder])
        return SemitrailerVehicle(profile, drives[geometry.wheels[0]], drives[geometry.steering.drive], angles)
    if isinstance(geometry, DifferentialGeometry):
        right, left = (devices.drives[name] for name in geometry.wheels)
        return DifferentialVehicle(profile, (right, left))
    if isinstance(geometry, OwnGeometry):
        return OwnKindVehicle(profile, *_in_order(devices, geometry))
    raise ConfigError(f"profile {profile.name}: no loops for a vehicle of type {type(geometry).__name__}")


def _in_order(
    devices: Devices, geometry: PairedSteerGeometry | OwnGeometry
) -> tuple[tuple[Drive, ...], tuple[SteeringEncoder, ...], tuple[Brake, ...]]:
    """Drives, encoders and brakes in the order of the vehicle."""
    return (
        tuple(devices.drives[name] for name in geometry.wheels),
        tuple(devices.encoders[name] for name in geometry.encoders),
        tuple(devices.brakes[name] for name in geometry.brakes),
    )
