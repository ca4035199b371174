"""``canhelm nxt``: a robot on two wheels at a LEGO MINDSTORMS NXT."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Annotated, Any, Literal

from cyclopts import App, Parameter

from canhelm.errors import UsageError
from daemon.cli.motion import run_motion
from daemon.cli.options import DEFAULT, MOTION, MotionOptions, NoWait, Options
from daemon.cli.output import show

app = App(name="nxt", help="Drive a robot on an NXT brick: lines, bends, poses, several moves in a row.")

Brick = Annotated[str | None, Parameter(help="Name of the brick in the profile, where there are several.")]


@Parameter(name="*")
@dataclass(frozen=True, slots=True)
class Driving:
    """How moves are driven."""

    power: float | None = None
    """Open loop: of the faster wheel, 1 to 100; 100 is 1000 degrees a second. Without it the profile's limit says."""
    compensate: Annotated[bool, Parameter(negative=())] = False
    """Open loop: take what a wheel turned too far off its next move; the brick does that itself, so it is off."""
    tolerance: float | None = None
    """Under feedback: metres in x and y that count as there (0.002)."""
    tolerance_deg: float | None = None
    """Under feedback: degrees of heading that count as there (1)."""
    timeout: float | None = None
    """Under feedback: seconds after which a goal is given up (30, and twice as long as the way takes)."""
    gains: Literal["slow", "report"] = "slow"
    """Under feedback: gains for cycles as slow as Bluetooth, or those of the NXT report."""
    speed: float | None = None
    """Under feedback: m/s, no faster than this."""

    def params(self, feedback: bool) -> dict[str, Any]:
        """As the API calls them. Raises UsageError where an option has no effect on moves driven like that."""
        for option in OPEN_LOOP_ALONE if feedback else FEEDBACK_ALONE:
            if getattr(self, option) != getattr(STEADY, option):
                how = "under feedback" if feedback else "open loop"
                name = option.replace("_", "-")
                remedy = "leave it out, or drive " + ("open loop" if feedback else "with feedback")
                raise UsageError(f"--{name} has no effect {how}", remedy=remedy)
        given = asdict(self)
        for name, unit in (("tolerance", "m"), ("timeout", "s"), ("speed", "m_s")):
            given[f"{name}_{unit}"] = given.pop(name)
        return given


STEADY = Driving()
OPEN_LOOP_ALONE = ("power", "compensate")
FEEDBACK_ALONE = ("tolerance", "tolerance_deg", "timeout", "gains", "speed")
Feedback = Annotated[
    bool, Parameter(negative=(), help="Seek the end of each move by odometry, instead of by the brick's tacho limits.")
]


@app.command
def line(
    distance: float,
    /,
    *,
    feedback: Feedback = False,
    driving: Driving = STEADY,
    no_wait: NoWait = False,
    options: MotionOptions = MOTION,
) -> int:
    """Drive straight on.

    Example: `canhelm nxt line 0.5 --power 30`

    Parameters
    ----------
    distance: float
        Metres; negative drives backward.
    """
    params = {"distance_m": distance, "feedback": feedback, **driving.params(feedback)}
    return run_motion(options, "nxt.line", no_wait=no_wait, **params)


@app.command
def bend(
    radius: float,
    angle: float,
    /,
    *,
    right: Annotated[bool, Parameter(negative=())] = False,
    backward: Annotated[bool, Parameter(negative=())] = False,
    feedback: Feedback = False,
    driving: Driving = STEADY,
    no_wait: NoWait = False,
    options: MotionOptions = MOTION,
) -> int:
    """Drive along a circle.

    Example: `canhelm nxt bend 0.2 90 --right`

    Parameters
    ----------
    radius: float
        Metres from the circle's centre to the robot's; 0 turns on the spot.
    angle: float
        Degrees, how far.
    right: bool
        To the right instead of the left.
    backward: bool
        Backward along the circle.
    """
    params = {"radius_m": radius, "angle_deg": angle, "side": "right" if right else "left", "backward": backward}
    driven = {"feedback": feedback, **driving.params(feedback)}
    return run_motion(options, "nxt.bend", no_wait=no_wait, **params, **driven)


@app.command
def goto(
    x: float,
    y: float,
    heading_deg: float = 0.0,
    /,
    *,
    open_loop: Annotated[bool, Parameter(negative=())] = False,
    driving: Driving = STEADY,
    no_wait: NoWait = False,
    options: MotionOptions = MOTION,
) -> int:
    """Drive to a pose as seen from where the robot stands; `canhelm drive to` counts from where the daemon began.

    Example: `canhelm nxt goto 0.2 0.2 90`

    Parameters
    ----------
    x: float
        Metres forward.
    y: float
        Metres to the left.
    heading_deg: float
        Degrees, counter-clockwise positive.
    open_loop: bool
        By tacho limits, as a turn, a line and a turn, instead of by feedback.
    """
    driven = {"feedback": not open_loop, **driving.params(feedback=not open_loop)}
    params = {"x_m": x, "y_m": y, "heading_deg": heading_deg, **driven}
    return run_motion(options, "nxt.goto", no_wait=no_wait, **params)


@app.command
def moves(
    *move: str,
    feedback: Feedback = False,
    driving: Driving = STEADY,
    no_wait: NoWait = False,
    options: MotionOptions = MOTION,
) -> int:
    """Drive several moves in a row, each from rest to rest.

    Example: `canhelm nxt moves "line 0.5" "bend 0.2 90" "bend 0.2 90 right back" "line -0.1"`

    Parameters
    ----------
    move: str
        `line METRES`, or `bend METRES DEGREES` with `right` and `back`.
    """
    params = {"moves": list(move), "feedback": feedback, **driving.params(feedback)}
    return run_motion(options, "nxt.moves", no_wait=no_wait, **params)


@app.command
def stop(*, options: Options = DEFAULT) -> None:
    """Stop the robot, as `canhelm stop`: the motors brake before anything else that waits.

    Example: `canhelm nxt stop`
    """
    with options.client() as client:
        show(client.call("stop"), json=options.json)


@app.command
def battery(brick: Brick = None, /, *, options: Options = DEFAULT) -> None:
    """Voltage of the battery, whether it is low, and whether moves are refused for it.

    Example: `canhelm nxt battery`
    """
    with options.client() as client:
        show(client.call("nxt.battery", brick=brick), json=options.json)


@app.command
def info(brick: Brick = None, /, *, options: Options = DEFAULT) -> None:
    """Name, Bluetooth address, firmware and memory of the brick.

    Example: `canhelm nxt info`
    """
    with options.client() as client:
        show(client.call("nxt.info", brick=brick), json=options.json)
