"""How poses are told in results and in ``status``."""

from __future__ import annotations

import math

from daemon.loops.odometry import Pose
from daemon.loops.path import wrap


def place_and_heading(pose: Pose) -> dict[str, float]:
    """A pose with its heading within half a turn."""
    return {**_place(pose), "heading_deg": round(math.degrees(wrap(pose.yaw_rad)), 3) + 0.0}


def place_and_yaw(pose: Pose) -> dict[str, float]:
    """A pose with its angle as it is counted, over whole turns, too."""
    return {**_place(pose), "yaw_deg": round(math.degrees(pose.yaw_rad), 3) + 0.0}


def _place(pose: Pose) -> dict[str, float]:
    return {"x_m": round(pose.x_m, 4) + 0.0, "y_m": round(pose.y_m, 4) + 0.0}  # not -0.0
