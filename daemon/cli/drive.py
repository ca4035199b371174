"""``canhelm drive``: the vehicle. Which motions it has, its profile says."""

from __future__ import annotations

from cyclopts import App

from daemon.cli.motion import run_motion
from daemon.cli.options import DEFAULT, NoWait, Options

app = App(name="drive", help="Drive the vehicle.")


@app.command
def parallel(
    *, angle: float, speed: float, duration: float, no_wait: NoWait = False, options: Options = DEFAULT
) -> int:
    """Move in a direction without turning.

    Example: `canhelm drive parallel --angle 30 --speed 0.4 --duration 3`

    Parameters
    ----------
    angle: float
        Direction in the robot's frame in degrees, counter-clockwise positive.
    speed: float
        m/s; negative drives backward.
    duration: float
        Seconds.
    """
    params = {"angle_deg": angle, "speed_m_s": speed, "duration_s": duration}
    return run_motion(options, "drive.parallel", no_wait=no_wait, **params)


@app.command
def turn(
    *, rear: float, front: float, speed: float, duration: float, no_wait: NoWait = False, options: Options = DEFAULT
) -> int:
    """Drive an arc with fixed headings of both pairs.

    Example: `canhelm drive turn --rear -15 --front 15 --speed 0.4 --duration 5`

    Parameters
    ----------
    rear: float
        Heading of the rear pair in degrees, counter-clockwise positive.
    front: float
        Heading of the front pair in degrees, counter-clockwise positive.
    speed: float
        m/s of the robot's centre; negative drives backward.
    duration: float
        Seconds.
    """
    params = {"rear_deg": rear, "front_deg": front, "speed_m_s": speed, "duration_s": duration}
    return run_motion(options, "drive.turn", no_wait=no_wait, **params)


@app.command
def rotate(rate_deg_s: float, /, *, no_wait: NoWait = False, options: Options = DEFAULT) -> int:
    """Turn about the own centre, on vehicles that can.

    Example: `canhelm drive rotate 20`

    Parameters
    ----------
    rate_deg_s: float
        Degrees a second, counter-clockwise positive.
    """
    return run_motion(options, "drive.rotate", no_wait=no_wait, rate_deg_s=rate_deg_s)
