"""``canhelm sdo``: objects of a node."""

from __future__ import annotations

from typing import Annotated

from cyclopts import App, Parameter

from daemon.cli.options import DEFAULT, Node, Options, node_of
from daemon.cli.output import show

app = App(name="sdo", help="Read and write objects of a node.")

ObjectName = Annotated[str, Parameter(name="OBJECT", help="Name (`canhelm object list`), 0x6041, or 0x2078/1.")]


@app.command
def read(node: Node, object_name: ObjectName, /, *, options: Options = DEFAULT) -> None:
    """Read an object.

    Example: `canhelm sdo read 1 0x6041`
    """
    wanted = node_of(node)
    with options.client() as client:
        show(client.call("sdo.read", node=wanted, object=object_name), json=options.json)


@app.command
def write(node: Node, object_name: ObjectName, value: str, /, *, options: Options = DEFAULT) -> None:
    """Write an object.

    Example: `canhelm sdo write 1 0x6083 2000`

    Parameters
    ----------
    value: str
        A number (also as 0x...), or text.
    """
    wanted = node_of(node)
    with options.client() as client:
        show(client.call("sdo.write", node=wanted, object=object_name, value=value_of(value)), json=options.json)


def value_of(text: str) -> int | float | str:
    """The number that a text says, or the text."""
    for kind in (lambda given: int(given, 0), float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text
