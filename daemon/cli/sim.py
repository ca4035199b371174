"""``canhelm sim``: what one does by hand to a real network, done to the simulated one."""

from __future__ import annotations

from typing import Annotated, Literal

from cyclopts import App, Parameter

from daemon.cli.options import DEFAULT, Node, Options, node_of
from daemon.cli.output import show

app = App(name="sim", help="Do things to the simulated network.")

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

    Example: `canhelm sim turn steering 12.5`
    """
    wanted = node_of(node)
    with options.client() as client:
        show(client.call("simulation.turn", node=wanted, angle_deg=angle), json=options.json)


@app.command(name="input")
def digital_input(node: Node, number: Input, level: Literal["low", "high"], /, *, options: Options = DEFAULT) -> None:
    """Apply a level to a digital input of a simulated drive, as an emergency stop button does.

    Example: `canhelm sim input front_left 1 low`
    """
    wanted = node_of(node)
    with options.client() as client:
        show(client.call("simulation.input", node=wanted, input=number, level=level), json=options.json)
