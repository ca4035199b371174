"""Drives a square that stands on a corner, by parallel movements: the robot does not turn.

Start a daemon first (`canhelm run --simulate --profile max2d`, or `turtle`), then `python examples/square.py`.
"""

import sys

from canhelm.client import Client
from canhelm.errors import CanhelmError

SIDE_M = 0.4
SPEED_M_S = 0.4
SIDES = ((45, SPEED_M_S), (-45, SPEED_M_S), (45, -SPEED_M_S), (-45, -SPEED_M_S))
"""Directions that a robot which steers by up to 85 degrees has, too; a negative speed drives backward."""


def main() -> None:
    """Drive the square; Ctrl-C or an error stops the robot."""
    with Client() as robot:
        for angle_deg, speed_m_s in SIDES:
            robot.call("drive.parallel", angle_deg=angle_deg, speed_m_s=speed_m_s, duration_s=SIDE_M / SPEED_M_S)
            place = robot.status()["vehicle"]["odometry"]
            print(f"corner at x {place['x_m']:.2f} m, y {place['y_m']:.2f} m, yaw {place['yaw_deg']:.1f} deg")


if __name__ == "__main__":
    try:
        main()
    except CanhelmError as error:
        sys.exit(str(error))
