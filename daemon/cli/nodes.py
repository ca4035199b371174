"""``canhelm nodes``: who is on the bus, what they keep, node ids and bit rates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Parameter

from daemon.cli.options import DEFAULT, Node, Options, agreed, node_of
from daemon.cli.output import say, show

if TYPE_CHECKING:
    from rich.table import Table

app = App(name="nodes", help="Who is on the bus; store and restore parameters; node ids and bit rates by LSS.")

COLUMNS = ("node", "name", "device", "firmware", "state", "remark")

Yes = Annotated[bool, Parameter(negative=(), help="Do not ask.")]
Device = Annotated[
    str, Parameter(help="Node id, a name from the profile, or an identity VENDOR:PRODUCT:REVISION:SERIAL.")
]


@app.command
def scan(*, first: int = 1, last: int = 127, options: Options = DEFAULT) -> None:
    """Ask every node id who it is, while watching for two nodes with one id and for a wrong bit rate.

    Example: `canhelm nodes scan`

    Args:
        first: First node id to ask.
        last: Last node id to ask.
    """
    with options.client() as client:
        found = client.call("nodes.scan", first=first, last=last)
    for remark in found["remarks"]:
        say(remark)
    show(found["nodes"], _table, options.json)


def _table(nodes: Sequence[dict[str, Any]]) -> Table:
    from rich.table import Table

    table = Table(*COLUMNS, box=None, header_style="bold", pad_edge=False)
    for node in nodes:
        table.add_row(*(str(node[column]) for column in COLUMNS))
    return table


@app.command
def store(node: Node, /, *, yes: Yes = False, options: Options = DEFAULT) -> None:
    """Let a node keep its parameters for the next power-up (object 0x1010). It asks first.

    Example: `canhelm nodes store front --yes`
    """
    _change("nodes.store", f"write the parameters of node {node} to its memory?", yes, options, node=node_of(node))


@app.command
def restore(node: Node, /, *, yes: Yes = False, options: Options = DEFAULT) -> None:
    """Give a node its factory values back, from its next restart on (object 0x1011). It asks first.

    Example: `canhelm nodes restore front --yes`
    """
    question = f"forget all parameters that node {node} has stored?"
    _change("nodes.restore", question, yes, options, node=node_of(node))


@app.command
def find(*, options: Options = DEFAULT) -> None:
    """Find a device without a node id by LSS fast scan, and print its identity.

    Example: `canhelm nodes find`
    """
    with options.client() as client:
        show(client.call("lss.find"), json=options.json)


@app.command
def set_id(device: Device, node_id: int, /, *, yes: Yes = False, options: Options = DEFAULT) -> None:
    """Give a drive, or a device with LSS (an encoder), another node id and let it store it. It asks first.

    Example: `canhelm nodes set-id 127 5`

    Args:
        node_id: The new node id, 1 to 127.
    """
    question = f"store node id {node_id} in {device}?"
    _change("lss.set_node_id", question, yes, options, device=device, node_id=node_id)


@app.command
def set_bit_rate(device: Device, bit_rate: int, /, *, yes: Yes = False, options: Options = DEFAULT) -> None:
    """Let a device with LSS (an encoder) store another bit rate, for its next power-up. It asks first.

    Example: `canhelm nodes set-bit-rate 5 500000`

    Args:
        bit_rate: In bit/s.
    """
    question = f"store {bit_rate} bit/s in {device}?"
    _change("lss.set_bit_rate", question, yes, options, device=device, bit_rate=bit_rate)


def _change(method: str, question: str, yes: bool, options: Options, **params: Any) -> None:
    if not (yes or agreed(question)):
        say("nothing was changed")
        return
    with options.client() as client:
        show(client.call(method, confirm=True, **params), json=options.json)
