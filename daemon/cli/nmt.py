"""``canhelm nmt``: network management commands."""

from __future__ import annotations

from typing import Annotated

from cyclopts import App, Parameter

from daemon.cli.options import DEFAULT, Options, node_of
from daemon.cli.output import show

app = App(name="nmt", help="Network management commands to one node, or to all nodes of the profile one by one.")

NodeOrAll = Annotated[str, Parameter(help="Node id (1 to 127), a name from the profile, or all.")]


def _send(command: str, node: str, options: Options) -> None:
    wanted = node_of(node)
    with options.client() as client:
        show(client.call("nmt", command=command, node=wanted), json=options.json)


@app.command
def start(node: NodeOrAll, /, *, options: Options = DEFAULT) -> None:
    """To operational: process data flow.

    Example: `canhelm nmt start 3`
    """
    _send("start", node, options)


@app.command
def stop(node: NodeOrAll, /, *, options: Options = DEFAULT) -> None:
    """To stopped: nothing but network management.

    Example: `canhelm nmt stop 3`
    """
    _send("stop", node, options)


@app.command
def preop(node: NodeOrAll, /, *, options: Options = DEFAULT) -> None:
    """To pre-operational: objects can be read and written, no process data.

    Example: `canhelm nmt preop all`
    """
    _send("preop", node, options)


@app.command
def reset(node: NodeOrAll, /, *, options: Options = DEFAULT) -> None:
    """Reset the node.

    Example: `canhelm nmt reset front_left`
    """
    _send("reset", node, options)


@app.command
def reset_comm(node: NodeOrAll, /, *, options: Options = DEFAULT) -> None:
    """Reset the node's communication objects.

    Example: `canhelm nmt reset-comm 3`
    """
    _send("reset-comm", node, options)
