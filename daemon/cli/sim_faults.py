"""``canhelm sim fault`` and ``canhelm sim faults``: faults in the simulated network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Parameter

from daemon.cli.options import DEFAULT, Options, node_of
from daemon.cli.output import say, show, wants_json, words

if TYPE_CHECKING:
    from rich.table import Table

fault = App(name="fault")

Kind = Annotated[str, Parameter(help="What happens: lose, silence, emcy, encoder_stuck, ...; docs/faults.md has all.")]
Part = Annotated[str | None, Parameter(help="Drive, encoder, brake or brick, by its name, or a node id.")]
_OWN = ("fault", "kind", "part", "state", "struck")
_DIGITS = {"cob_id": 3, "code": 4, "value": 1}
"""Hexadecimal digits that a field has at least; SDO abort codes have eight."""


@fault.default
def set_fault(
    kind: Kind,
    part: Part = None,
    /,
    *,
    cob_id: int | None = None,
    object: str | None = None,
    at: float | None = None,
    at_frame: int | None = None,
    lasting: Annotated[float | None, Parameter(name="--for")] = None,
    nth: int | None = None,
    probability: float | None = None,
    times: int | None = None,
    delay: float | None = None,
    code: int | None = None,
    value: int | None = None,
    angle: float | None = None,
    friction: float | None = None,
    jump: float | None = None,
    clients: int | None = None,
    options: Options = DEFAULT,
) -> None:
    """Put a fault into the simulated network, at once or later.

    Example: `canhelm sim fault silence front_left --for 2`

    Args:
        cob_id: Frames of this identifier only (0x181).
        object: SDO transfers of this object only (0x6060, 0x1018/2).
        at: Seconds from now to its beginning.
        at_frame: Frame on the bus that it begins with; the next one is 1.
        lasting: Seconds that it lasts; until it is cleared without it.
        nth: Only this one of the frames or requests that fit.
        probability: Share that it strikes, up to 1.
        times: How many it strikes at most.
        delay: Seconds by which frames come late.
        code: EMCY code (0x4210), or SDO abort code.
        value: What an object says instead of the truth.
        angle: Degrees of an encoder: of the motor shaft, or the steered axis.
        friction: Coefficient of friction.
        jump: Seconds by which the daemon's clock is set, back where negative.
        clients: How many clients flood the daemon.
    """
    when = {"at_s": at, "at_frame": at_frame, "for_s": lasting}
    which = {"cob_id": cob_id, "object": object, "nth": nth, "probability": probability, "times": times}
    what = {
        "delay_s": delay,
        "code": code,
        "value": value,
        "angle_deg": angle,
        "friction": friction,
        "jump_s": jump,
        "clients": clients,
    }
    given = {name: item for name, item in {**when, **which, **what}.items() if item is not None}
    with options.client() as client:
        where = {} if part is None else {"part": node_of(part)}
        told = client.call("simulation.fault", kind=kind, **where, **given)
    show(told if wants_json(options.json) else _as_typed(told), json=options.json)


@fault.command
def clear(number: int | None = None, /, *, options: Options = DEFAULT) -> None:
    """Take away one fault, or all.

    Example: `canhelm sim fault clear`

    Args:
        number: Of the fault, as `canhelm sim faults` shows it.
    """
    with options.client() as client:
        show(client.call("simulation.clear_faults", fault=number), json=options.json)


def faults(*, options: Options = DEFAULT) -> None:
    """The faults that were set: which wait, act or are over, and how often each has struck.

    Example: `canhelm sim faults`
    """
    with options.client() as client:
        found: list[dict[str, Any]] = client.call("simulation.faults")["faults"]
    if not found:
        say("no fault is set; `canhelm sim fault KIND` sets one")
    else:
        show(found, _table, options.json)


def _table(rows: Sequence[Mapping[str, Any]]) -> Table:
    from rich.table import Table

    table = Table(*_OWN, "more")
    for row in rows:
        more = {key: value for key, value in _as_typed(row).items() if key not in _OWN}
        table.add_row(*(words(row.get(key)) for key in _OWN), words(more))
    return table


def _as_typed(row: Mapping[str, Any]) -> dict[str, Any]:
    """A fault with its identifiers and codes in hexadecimal."""
    return {key: _hexadecimal(key, value) if key in _DIGITS else value for key, value in row.items()}


def _hexadecimal(key: str, value: int) -> str:
    digits = 8 if key == "code" and value > 0xFFFF else _DIGITS[key]
    return f"0x{value:0{digits}X}"
