"""Where a truck is, from what its driven axle has rolled and where its front axle points."""

from __future__ import annotations

import math

from daemon.loops.odometry import MAX_STEP_M, Pose, moved_along_arc
from daemon.loops.path import wrap


class TruckOdometry:
    """Adds up the way of the driven axle, along the arc that the steering angle makes of it.

    Args:
        wheelbase_m: from the steered to the driven axle.

    Attributes:
        pose: of the driven axle's middle; may be set where something else knows better.
        skipped: readings that were not used because they cannot be true.
    """

    def __init__(self, wheelbase_m: float) -> None:
        self._wheelbase_m = wheelbase_m
        self._last: tuple[float, float] | None = None
        self.pose = Pose()
        self.skipped = 0

    def update(self, travel_m: float, steering_rad: float) -> Pose:
        """Take one cycle's reading; the first one only sets the start.

        Args:
            travel_m: what the driven axle has rolled since its count began.
            steering_rad: of the front axle, counter-clockwise positive.
        """
        last, self._last = self._last, (travel_m, steering_rad)
        if last is None:
            return self.pose
        way, mean = travel_m - last[0], (steering_rad + last[1]) / 2
        if abs(way) > MAX_STEP_M:
            self.skipped += 1
        elif way:
            self.pose = moved_along_arc(self.pose, way, 0.0, way * math.tan(mean) / self._wheelbase_m)
        return self.pose

    def correct(self, pose: Pose, weight: float) -> None:
        """Take over what somebody else says of the pose.

        Args:
            pose: of the driven axle's middle.
            weight: of that against the own pose: 1 believes it, 0 does not.
        """
        own = self.pose
        x, y = own.x_m + weight * (pose.x_m - own.x_m), own.y_m + weight * (pose.y_m - own.y_m)
        self.pose = Pose(x, y, own.yaw_rad + weight * wrap(pose.yaw_rad - own.yaw_rad))
