"""``canhelm steer``."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from daemon.cli.motion import run_motion
from daemon.cli.options import MOTION, MotionOptions, NoWait

Pair = Annotated[str, Parameter(help="front or rear.")]


def steer(pair: Pair, angle_deg: float, /, *, no_wait: NoWait = False, options: MotionOptions = MOTION) -> int:
    """Turn a pair of wheels to a heading, the other pair braked.

    Example: `canhelm steer front -30`

    Parameters
    ----------
    angle_deg: float
        Heading of the wheels in the robot's frame, counter-clockwise positive.
    """
    return run_motion(options, "steer", no_wait=no_wait, pair=pair, angle_deg=angle_deg)
