"""``canhelm sim``: what one does by hand to a real network, done to the simulated one."""

from __future__ import annotations

from typing import Annotated, Literal

from cyclopts import App, Parameter

from daemon.cli.options import DEFAULT, Node, Options, node_of
from daemon.cli.output import show
from daemon.cli.sim_faults import fault, faults

app = App(name="sim", help="Do things to the simulated network.")
app.command(fault)
app.command(faults)

Input = Annotated[int, Parameter(help="Number of the digital input, 1 to 6.")]
NodeOrAll = Annotated[str, Parameter(help="Node id (1 to 127), a name from the profile, or all.")]


@app.command
def power(node: NodeOrAll, state: Literal["on", "off"], /, *, options: Options = DEFAULT) -> None:
    """Switch the supply of a simulated node.

    Example: `canhelm sim power 3 off`
    """
    wanted = node_of(node)
    with options.client() as client:
        show(client.call("simulation.power", node=wanted, on=state == "on"), json=options.json)


@app.command
def turn(node: Node, angle: float | None = None, /, *, options: Options = DEFAULT) -> None:
    """Hold the axis of a simulated encoder by hand at an angle, as for a calibration; without an angle, let go of it.

    Example: `canhelm sim turn steering_angle 12.5`
    """
    wanted = node_of(node)
    with options.client() as client:
        show(client.call("simulation.turn", node=wanted, angle_deg=angle), json=options.json)


@app.command
def slope(degrees: float, /, *, direction: float = 0.0, options: Options = DEFAULT) -> None:
    """Tilt the floor under the simulated robot, up to 20 degrees; 0 makes it level again.

    Example: `canhelm sim slope 5 --direction 180`

    Args:
        degrees: Against the level.
        direction: Degrees from where the robot pointed at the beginning, counter-clockwise, to where it leads down.
    """
    with options.client() as client:
        told = client.call("simulation.slope", slope_deg=degrees, direction_deg=direction)
    show(told, json=options.json)


@app.command
def pace(factor: float, /, *, options: Options = DEFAULT) -> None:
    """Let the time of a simulated robot pass faster or slower, from 0.1 to 4 times, as far as the machine can follow.

    Example: `canhelm sim pace 0.25`
    """
    with options.client() as client:
        show(client.call("simulation.pace", factor=factor), json=options.json)


@app.command
def lift(state: Literal["on", "off"], /, *, options: Options = DEFAULT) -> None:
    """Put the simulated robot onto blocks, its wheels in the air, or down again.

    Example: `canhelm sim lift on`
    """
    with options.client() as client:
        show(client.call("simulation.lift", lifted=state == "on"), json=options.json)


@app.command
def hand(name: str, angle: float, /, *, options: Options = DEFAULT) -> None:
    """Turn a wheel of the lifted simulated robot by hand, forward for a positive angle, or push a wheel pair.

    Example: `canhelm sim hand front_left 360`

    Args:
        name: Wheel by its drive (front_left), or pair by its encoder (front), as the robot is built.
        angle: Degrees.
    """
    with options.client() as client:
        show(client.call("simulation.hand", name=name, angle_deg=angle), json=options.json)


@app.command
def look(*, options: Options = DEFAULT) -> None:
    """What a person sees of the simulated robot: where it stands, wheels, headings, brakes.

    Example: `canhelm sim look`
    """
    with options.client() as client:
        show(client.call("simulation.look"), json=options.json)


@app.command(name="input")
def digital_input(node: Node, number: Input, level: Literal["low", "high"], /, *, options: Options = DEFAULT) -> None:
    """Apply a level to a digital input of a simulated drive, as an emergency stop button does.

    Example: `canhelm sim input front_left 1 low`
    """
    wanted = node_of(node)
    with options.client() as client:
        show(client.call("simulation.input", node=wanted, input=number, level=level), json=options.json)
