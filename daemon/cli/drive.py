"""``canhelm drive``: the vehicle. Which motions it has, its profile says."""

from __future__ import annotations

from typing import Annotated, Any

from cyclopts import App, Parameter

from daemon.cli.motion import run_motion
from daemon.cli.options import DEFAULT, MOTION, MotionOptions, NoWait, Options
from daemon.cli.output import Json

app = App(name="drive", help="Drive the vehicle.")


@app.command
def parallel(
    *, angle: float, speed: float, duration: float, no_wait: NoWait = False, options: MotionOptions = MOTION
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
    *,
    rear: float,
    front: float,
    speed: float,
    duration: float,
    no_wait: NoWait = False,
    options: MotionOptions = MOTION,
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
def heading(
    heading_deg: float,
    /,
    *,
    speed: float,
    duration: float,
    no_wait: NoWait = False,
    options: MotionOptions = MOTION,
) -> int:
    """Steer to a heading while driving, on vehicles that can.

    Example: `canhelm drive heading 45 --speed 1 --duration 4`

    Parameters
    ----------
    heading_deg: float
        Degrees, counter-clockwise positive; 0 is where the vehicle pointed when the daemon began.
    speed: float
        m/s.
    duration: float
        Seconds, until the vehicle begins to slow down.
    """
    params = {"heading_deg": heading_deg, "speed_m_s": speed, "duration_s": duration}
    return run_motion(options, "drive.heading", no_wait=no_wait, **params)


@app.command
def rotate(
    rate_deg_s: float,
    /,
    *,
    duration: float | None = None,
    no_wait: NoWait = False,
    options: MotionOptions = MOTION,
) -> int:
    """Turn about the own centre, on vehicles that can; for a time or until Ctrl-C or `canhelm stop`.

    Example: `canhelm drive rotate 20 --duration 3`

    Parameters
    ----------
    rate_deg_s: float
        A rate, not an angle: degrees a second, counter-clockwise positive. `drive to` turns by an angle.
    duration: float
        Seconds; without it the turn has no end of its own.
    """
    return run_motion(options, "drive.rotate", no_wait=no_wait, rate_deg_s=rate_deg_s, duration_s=duration)


@app.command
def to(
    x: float,
    y: float,
    heading_deg: float | None = None,
    /,
    *,
    end_velocity: Annotated[tuple[float, float], Parameter(negative=())] = (0.0, 0.0),
    speed: float | None = None,
    published: Annotated[bool, Parameter(negative=())] = False,
    no_wait: NoWait = False,
    options: MotionOptions = MOTION,
) -> int:
    """Drive to a place in the shortest time, on vehicles that can; place and heading are reached together.

    Example: `canhelm drive to 2 -0.5 90 --end-velocity 0.4 0`

    Parameters
    ----------
    x: float
        Metres forward of where the daemon began to count.
    y: float
        Metres to the left of it.
    heading_deg: float
        Degrees, counter-clockwise positive; without it the heading stays.
    end_velocity: tuple[float, float]
        m/s along x and y at the goal; the robot comes to rest behind it.
    speed: float
        m/s, no faster than this.
    published: bool
        By the planner and the traction controller that the Turtle robot's report prints, for comparison: only to a
        place, at rest, and given up after a time.
    """
    params: dict[str, Any] = {
        "x_m": x,
        "y_m": y,
        "heading_deg": heading_deg,
        "end_vx_m_s": end_velocity[0],
        "end_vy_m_s": end_velocity[1],
        "speed_m_s": speed,
        "planner": "published" if published else "optimal",
    }
    return run_motion(options, "drive.to", no_wait=no_wait, **params)


@app.command
def path(
    file: str,
    /,
    *,
    backward: Annotated[bool, Parameter(negative=())] = False,
    speed: float | None = None,
    published: Annotated[bool, Parameter(negative=())] = False,
    dry_run: Annotated[bool, Parameter(negative=())] = False,
    no_wait: NoWait = False,
    options: MotionOptions = MOTION,
) -> int:
    """Follow a path of lines and arcs, on vehicles that can.

    Example: `canhelm drive path circle --backward`

    Parameters
    ----------
    file: str
        A path file (docs/paths.md), or a shipped one: line, circle, eight, reverse, park-parallel, park-perpendicular.
    backward: bool
        Drive backward what the file says is driven forward, and the other way round.
    speed: float
        m/s, no faster than this.
    published: bool
        By the law of the semi-trailer thesis, put right, for comparison.
    dry_run: bool
        Only check the path, and tell how it would be driven.
    """
    from daemon.cli.path_sending import drive_path

    params = {
        "backward": backward,
        "speed_m_s": speed,
        "law": "published" if published else "cascade",
        "dry_run": dry_run,
    }
    return drive_path(options, file, no_wait=no_wait, **params)


@app.command
def joystick(
    *,
    pads: Annotated[bool, Parameter(name="--list", negative=())] = False,
    pad: str | None = None,
    options: MotionOptions = MOTION,
) -> int:
    """Drive with a gamepad that is plugged into this machine, until Ctrl-C; the dead-man button is held meanwhile.

    Example: `canhelm drive joystick --list`

    Parameters
    ----------
    pads: bool
        Only show which gamepads there are, and whether they can be read; needs no daemon.
    pad: str
        Name or path of the gamepad; the first one where left out.
    """
    from daemon.cli.joystick import drive_joystick, show_pads

    return show_pads(options.json) if pads else drive_joystick(pad, options)


@app.command
def record(file: str, /, *, duration: float | None = None, rate: float = 10.0, options: Options = DEFAULT) -> int:
    """Record where the vehicle goes, whoever drives it, until Ctrl-C; `canhelm drive fit` makes a path of it.

    Example: `canhelm drive record way.csv --duration 60`

    Parameters
    ----------
    file: str
        Where to write the record (CSV).
    duration: float
        Seconds.
    rate: float
        Rows a second, up to 50.
    """
    from daemon.cli.path_recording import record as record_path

    return record_path(options, file, duration, rate)


@app.command
def fit(record: str, file: str, /, *, tolerance: float = 0.01, json: Json = None) -> int:
    """Make a path file of lines and arcs from a record; needs no daemon.

    Example: `canhelm drive fit way.csv way.yaml --tolerance 0.005`

    Parameters
    ----------
    record: str
        What `canhelm drive record` wrote.
    file: str
        The path file to write.
    tolerance: float
        Metres by which the path may be off what was recorded.
    """
    from daemon.cli.path_recording import fit as fit_path

    return fit_path(record, file, tolerance, json)
