"""Drives on a stand: their wheels turn in the air, each for itself, and nothing goes anywhere."""

from __future__ import annotations

from collections.abc import Collection
from random import Random

from canhelm.errors import ConfigError
from drivers.simulated.body import BodyWorld
from drivers.simulated.motor import WheelDrive
from drivers.simulated.world import STEP_S
from profiles.schema import Profile


class StandWorld(BodyWorld):
    """The stand.

    Args:
        profile: the robot.
        names: of those of its drives that are on it.
        seed: of where within an encoder count each motor shaft stands at the start.

    Raises:
        ConfigError: there are drives, and no simulation section says what supplies them.
    """

    def __init__(self, profile: Profile, names: Collection[str], seed: int = 0) -> None:
        if names and profile.simulation is None:
            raise ConfigError(
                f"profile {profile.name} cannot be simulated: its drives need the section simulation",
                object="simulation",
                remedy="add it, as in `canhelm profile show max2d`",
            )
        random = Random(seed)
        drives = {
            name: WheelDrive(profile.drives[name], profile.simulation, random.random())
            for name in names
            if profile.simulation is not None
        }
        super().__init__(drives, 1.0, (0.0, 0.0, 0.0), STEP_S)
        brakes = profile.brakes.items()
        self._fit_brakes(profile, {name: drives[brake.drive] for name, brake in brakes if brake.drive in drives})

    @property
    def slip_ratio(self) -> tuple[float, ...]:
        """None: nothing touches a floor."""
        return (0.0,) * len(self._drives)

    @property
    def slip_angle_rad(self) -> tuple[float, ...]:
        """None: nothing touches a floor."""
        return (0.0,) * len(self._drives)

    def heading_rad(self, pair: str) -> float:
        """A stand steers nothing."""
        return 0.0

    def _step(self) -> None:
        for drive in self._drives:
            drive.turn(0.0, 0.0, self._step_s)
