"""Drives a rhombus by parallel movements: forward, to the left, back, to the right; the robot does not turn.

Start a daemon first (`canhelm run --simulate --profile max2d`), then `python examples/rhombus.py`.
"""

from __future__ import annotations

import sys

from canhelm.client import Client
from canhelm.errors import CanhelmError

SIDE_M = 0.5
SPEED_M_S = 0.4


def main() -> int:
    """Drive the rhombus; Ctrl-C or an error stops the robot."""
    with Client() as robot:
        for angle_deg, speed_m_s in ((0, SPEED_M_S), (80, SPEED_M_S), (0, -SPEED_M_S), (80, -SPEED_M_S)):
            robot.call("drive.parallel", angle_deg=angle_deg, speed_m_s=speed_m_s, duration_s=SIDE_M / SPEED_M_S)
            print(robot.status()["vehicle"]["odometry"])
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except CanhelmError as error:
        sys.exit(f"{error}")
