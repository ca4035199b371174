"""What there is to see of a vehicle now, beyond its own status; made when somebody asks, never in the control cycle."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from daemon.runtime.motions import Motion
from daemon.runtime.poses import place_and_yaw
from daemon.runtime.vehicle import Vehicle


def view_of(vehicle: Vehicle, motions: Iterable[Motion]) -> dict[str, Any]:
    """Pose, headings of the wheels, centre of rotation, and how it stands to the path that it follows.

    The pose is the odometry's, which a localisation keeps in its own frame.

    Args:
        vehicle: as it is now.
        motions: under way.
    """
    place, centre = vehicle.place, vehicle.turning_centre
    headings = vehicle.wheel_headings().items()
    return {
        "pose": None if place is None else place_and_yaw(place),
        "wheels_deg": {name: round(math.degrees(heading), 2) + 0.0 for name, heading in headings},
        "icr": None if centre is None else {"x_m": round(centre[0], 4) + 0.0, "y_m": round(centre[1], 4) + 0.0},
        "following": _following(motions),
    }


def followed(motions: Iterable[Motion]) -> Motion | None:
    """The motion that follows a path; None where none does."""
    return next((motion for motion in motions if motion.path is not None and not motion.ended.done()), None)


def _following(motions: Iterable[Motion]) -> dict[str, Any] | None:
    motion = followed(motions)
    following = motion.following() if motion else None
    return {"motion": motion.identity, **following.told()} if motion and following else None
