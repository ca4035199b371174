"""A control loop of one's own: set-points at 100 Hz bring the robot half a metre forward, by a law of this program.

Each set-point is good for 100 ms: a program that hangs or dies lets the robot come to rest.
Start a daemon first (`canhelm run --simulate --profile max2d`), then `python examples/own_loop.py`.
"""

import asyncio
import math
import sys

from canhelm.aio import Client
from canhelm.errors import CanhelmError

PERIOD_S, WAY_M, NEAR_M = 0.01, 0.5, 0.002
GAIN_1_S, FASTEST_M_S, SLOWEST_M_S = 3.0, 0.4, 0.01


async def main() -> None:
    """The loop: measure, compute, command; then `stop`."""
    loop = asyncio.get_running_loop()
    async with Client() as robot:
        start = (await robot.status())["vehicle"]["odometry"]
        begin_s, steps, missing_m = loop.time(), 0, WAY_M
        while missing_m > NEAR_M:
            speed = max(SLOWEST_M_S, min(FASTEST_M_S, GAIN_1_S * missing_m))
            await robot.call("drive.set", direction_deg=0, speed_m_s=speed, valid_for_ms=100)
            here = (await robot.status())["vehicle"]["odometry"]
            missing_m = WAY_M - math.hypot(here["x_m"] - start["x_m"], here["y_m"] - start["y_m"])
            steps += 1
            await asyncio.sleep(begin_s + steps * PERIOD_S - loop.time())
        rate_hz = steps / (loop.time() - begin_s)
        await robot.stop()
        print(f"{WAY_M - missing_m:.3f} m in {steps} set-points at {rate_hz:.1f} Hz")


if __name__ == "__main__":
    try:
        asyncio.run(main())
    except CanhelmError as error:
        sys.exit(str(error))
