"""``canhelm motor``: one motor."""

from __future__ import annotations

from typing import Annotated, Any

from cyclopts import App, Parameter

from daemon.cli.motion import run_motion
from daemon.cli.options import DEFAULT, MOTION, MotionOptions, Node, NoWait, Options, node_of
from daemon.cli.output import show

app = App(name="motor", help="Enable, turn and stop one motor.")


def _call(options: Options, method: str, node: str, **params: Any) -> None:
    wanted = node_of(node)
    with options.client() as client:
        show(client.call(method, node=wanted, **params), json=options.json)


@app.command
def velocity(
    node: Node,
    value: float,
    /,
    *,
    wheel: Annotated[bool, Parameter(negative=())] = False,
    duration: float | None = None,
    no_wait: NoWait = False,
    options: MotionOptions = MOTION,
) -> int:
    """Turn a motor at a velocity, for a time or until Ctrl-C or `canhelm stop`.

    Example: `canhelm motor velocity 1 -250 --duration 2`

    Parameters
    ----------
    value: float
        rpm at the motor; m/s at the wheel with --wheel.
    wheel: bool
        VALUE is the speed of the wheel's rim in m/s.
    duration: float
        Seconds.
    """
    target = {"wheel_speed_m_s": value} if wheel else {"velocity_rpm": value}
    return run_motion(options, "motor.velocity", no_wait=no_wait, node=node_of(node), duration_s=duration, **target)


@app.command
def position(
    node: Node,
    position_qc: int,
    /,
    *,
    relative: Annotated[bool, Parameter(negative=())] = False,
    velocity: float | None = None,
    no_wait: NoWait = False,
    options: MotionOptions = MOTION,
) -> int:
    """Turn a motor to a position.

    Example: `canhelm motor position front_left -2000 --relative`

    Parameters
    ----------
    position_qc: int
        Quad counts of its encoder.
    relative: bool
        From where it stands.
    velocity: float
        rpm on the way.
    """
    params = {"position_qc": position_qc, "relative": relative, "velocity_rpm": velocity}
    return run_motion(options, "motor.position", no_wait=no_wait, node=node_of(node), **params)


@app.command
def current(
    node: Node,
    current_ma: float,
    /,
    *,
    duration: float | None = None,
    no_wait: NoWait = False,
    options: MotionOptions = MOTION,
) -> int:
    """Feed a motor with a current, for a time or until Ctrl-C or `canhelm stop`.

    Example: `canhelm motor current 1 300 --duration 0.5`

    Parameters
    ----------
    current_ma: float
        mA.
    duration: float
        Seconds.
    """
    params = {"current_ma": current_ma, "duration_s": duration}
    return run_motion(options, "motor.current", no_wait=no_wait, node=node_of(node), **params)


@app.command
def home(node: Node, /, *, method: int, no_wait: NoWait = False, options: MotionOptions = MOTION) -> int:
    """Home a motor.

    Example: `canhelm motor home 1 --method 35`

    Parameters
    ----------
    method: int
        Homing method (object 0x6098): 35 takes the present position, -3 and -4 find a stop by current.
    """
    return run_motion(options, "motor.home", no_wait=no_wait, node=node_of(node), method=method)


@app.command
def step(
    node: Node, rpm: float, /, *, duration: float = 1.0, no_wait: NoWait = False, options: MotionOptions = MOTION
) -> int:
    """A step of velocity on one motor.

    Example: `canhelm motor step 1 500 --duration 0.5`

    Parameters
    ----------
    rpm: float
        rpm at the motor.
    duration: float
        Seconds.
    """
    params = {"velocity_rpm": rpm, "duration_s": duration}
    return run_motion(options, "motor.step", no_wait=no_wait, node=node_of(node), **params)


@app.command
def enable(node: Node, /, *, options: Options = DEFAULT) -> None:
    """Switch the power stage on; the motor holds zero speed.

    Example: `canhelm motor enable 1`
    """
    _call(options, "motor.enable", node)


@app.command
def disable(node: Node, /, *, options: Options = DEFAULT) -> None:
    """Switch the power stage off.

    Example: `canhelm motor disable front_left`
    """
    _call(options, "motor.disable", node)


@app.command
def stop(node: Node, /, *, options: Options = DEFAULT) -> None:
    """End the motion of one motor by its ramp.

    Example: `canhelm motor stop 1`
    """
    _call(options, "motor.stop", node)


@app.command
def quick_stop(node: Node, /, *, options: Options = DEFAULT) -> None:
    """Quick stop of one motor.

    Example: `canhelm motor quick-stop 1`
    """
    _call(options, "motor.quick_stop", node)


@app.command
def reset(node: Node, /, *, options: Options = DEFAULT) -> None:
    """Clear a fault of one drive, once its cause is gone.

    Example: `canhelm motor reset 1`
    """
    _call(options, "motor.reset", node)
