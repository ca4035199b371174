"""``canhelm profile``: list, show, check and begin robot profiles."""

from __future__ import annotations

import json as json_text
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
from cyclopts import App, Parameter

from canhelm.errors import ConfigError, Refused, UsageError
from daemon.cli.output import Json, say, show, wants_json, words
from profiles import catalogue
from profiles.loader import CALIBRATION, SHIPPED, LoadedProfile, ProfileError, available, load
from profiles.provenance import FieldPath, dotted
from profiles.schema import SCHEMA_VERSION

if TYPE_CHECKING:
    from rich.table import Table

app = App(name="profile", help="Profiles of robots: list, show, check, begin a new one.")

DEFAULT = "default"
"""Origin of a value that no file gives."""
_SHIPPED_ROOT = f"{SHIPPED.parent}/"

_NEW = """\
# {name}: what differs from {base} stands here; `canhelm profile show {base} --effective` lists what there is.
schema_version: {version}
name: {name}
extends: {base}
setup: needed   # `canhelm setup` looks at every wheel, encoder and brake first; `waived` drives without

{sample}# limits:
#   speed_m_s: {speed_m_s:g}
"""


_NEW_DRIVE = """\
# drives:
#   {name}: {{node: 11, wheel_radius_m: {radius_m:g}}}
"""


@app.command(name="list")
def list_(*, json: Json = None) -> None:
    """The profiles that can be used by name.

    Example: `canhelm profile list`
    """
    show([_summary(path) for path in available()], table=_table, json=json)


@app.command(name="show")
def show_(name: str, /, *, effective: Annotated[bool, Parameter(negative=())] = False, json: Json = None) -> None:
    """What a profile says; assumed values are marked.

    Example: `canhelm profile show max2d --effective`

    Args:
        name: Name of a profile, or a YAML file.
        effective: Every value with where it comes from: file and line, or the default.
    """
    loaded = load(name)
    rows = list(_rows(loaded))
    show(rows if effective else [row for row in rows if _is_own(row, loaded.path)], table=_table, json=json)


@app.command(name="catalogue")
def catalogue_(pattern: str = "", /, *, json: Json = None) -> None:
    """Motors, encoders and gears by maxon order number, for `extends: catalogue/NUMBER` in a profile.

    Example: `canhelm profile catalogue HEDL`

    Args:
        pattern: Part of a number, kind or name, capitals alike.
    """
    rows = [_part_row(part) for part in catalogue.parts().values()]
    wanted = pattern.lower()
    show([row for row in rows if wanted in " ".join(map(str, row.values())).lower()], table=_table, json=json)


def _part_row(part: catalogue.Part) -> dict[str, Any]:
    return {
        "order_number": part.order_number,
        "kind": part.kind,
        "name": part.name,
        "assumed": ", ".join(part.assumed),
        "source": part.source,
    }


@app.command
def check(file: str, /, *, json: Json = None) -> None:
    """Check a profile and name file and line of every mistake (exit code 7).

    Example: `canhelm profile check myrobot.yaml`

    Args:
        file: A YAML file, or the name of a profile.
    """
    try:
        loaded = load(file)
    except ProfileError as error:
        if wants_json(json):
            show([_mistake_row(error, index) for index in range(len(error.mistakes))], json=True)
        raise
    for warning in loaded.warnings:
        say(f"warning: {warning}")
    show({"valid": True, **_counts(loaded), "file": str(loaded.path)}, json=json)


@app.command
def schema() -> None:
    """JSON Schema of a profile, for editors.

    Example: `canhelm profile schema > canhelm.schema.json`
    """
    from profiles.json_schema import json_schema

    print(json_text.dumps(json_schema(), indent=2))


@app.command
def new(name: str, /, *, extends: str = "max2d", out: Path | None = None) -> None:
    """Begin a profile of your own that extends another one.

    Example: `canhelm profile new lab1 --extends max2d --out lab1.yaml`

    Args:
        name: Name of the robot.
        extends: Name of the profile to begin with.
        out: File to write; the default is to print it.
    """
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]{0,39}", name):
        raise UsageError(
            f"{name!r} is no name of a robot", value=name, remedy="begin with a letter; use A-Z a-z 0-9 _ -"
        )
    base = load(extends).profile
    sample = "".join(
        _NEW_DRIVE.format(name=drive, radius_m=config.wheel_radius_m) for drive, config in [*base.drives.items()][:1]
    )
    speed = base.limits.speed_m_s
    text = _NEW.format(name=name, base=extends, version=SCHEMA_VERSION, sample=sample, speed_m_s=speed)
    if out is None:
        print(text, end="")
        return
    try:
        with out.open("x", encoding="utf-8") as file:
            file.write(text)
    except OSError as error:
        raise Refused(
            f"{out} cannot be written: {error.strerror}", value=str(out), remedy="choose another --out"
        ) from error
    say(f"{out} is written; run it with `canhelm run --profile {out} --bus ...`, then `canhelm setup`")


def _summary(path: Path) -> dict[str, Any]:
    """One line of ``profile list``."""
    try:
        loaded = load(path)
    except ConfigError as error:
        return {
            "name": path.stem,
            "valid": False,
            "description": error.message.splitlines()[0].rstrip(":"),
            "file": str(path),
        }
    profile = loaded.profile
    return {"name": path.stem, "valid": True, "description": profile.description, "file": str(path)}


def _counts(loaded: LoadedProfile) -> dict[str, Any]:
    profile = loaded.profile
    parts = {
        "drives": len(profile.drives),
        "bricks": len(profile.bricks),
        "encoders": len(profile.encoders),
        "brakes": len(profile.brakes),
    }
    values = {"values": len(loaded.origin), "assumed_values": len(loaded.assumed), "warnings": len(loaded.warnings)}
    return {"name": profile.name, **parts, **values}


def _rows(loaded: LoadedProfile) -> Iterator[dict[str, Any]]:
    """Every value of a profile with its origin."""
    for field, value in _flat(msgspec.to_builtins(loaded.profile)):
        origin = loaded.origin.get(field, DEFAULT)
        yield {"field": field, "value": value, "assumed": field in loaded.assumed, "origin": origin}


def _flat(value: Any, path: FieldPath = ()) -> Iterator[tuple[str, Any]]:
    if not isinstance(value, dict | list | tuple):
        yield dotted(path), value
        return
    children = value.items() if isinstance(value, dict) else enumerate(value)
    for step, child in children:
        yield from _flat(child, (*path, step))


def _is_own(row: dict[str, Any], path: Path) -> bool:
    """True for a value that the robot's own file or its calibration gives."""
    return row["origin"].rpartition(":")[0] in (str(path), str(path.with_name(path.stem + CALIBRATION)))


def _mistake_row(error: ProfileError, index: int) -> dict[str, Any]:
    mistake = error.mistakes[index]
    where = {"place": str(mistake.place), "file": mistake.place.file, "line": mistake.place.line}
    return {"field": mistake.field, "mistake": mistake.what, "remedy": mistake.remedy, **where}


def _table(rows: list[dict[str, Any]]) -> Table:
    """A column a key, a line a row; shipped files are named from ``profiles/`` on."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    for column in rows[0] if rows else ():
        table.add_column(column, overflow="fold")
    for row in rows:
        table.add_row(*(words(value, digits=6).removeprefix(_SHIPPED_ROOT) for value in row.values()))
    return table
