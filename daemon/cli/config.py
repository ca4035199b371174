"""``canhelm config``: the settings of drives, kept in DCF files (CiA 306)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Parameter

from canhelm.errors import ConfigError, NodeAbsent
from daemon.cli.options import DEFAULT, Node, Options, agreed, node_of
from daemon.cli.output import say, show, wants_json
from drivers.canopen.dcf import Commissioning, make_dcf
from drivers.canopen.eds_text import EdsText, read_eds_text
from drivers.canopen.objects import parse_address
from drivers.epos.objects import OBJECTS
from drivers.epos.parameters import EPOS_24_5, SETTINGS
from drivers.explain_codes import value_words

if TYPE_CHECKING:
    from rich.table import Table

app = App(name="config", help="Read, compare, write and keep the settings of drives.")

DryRun = Annotated[bool, Parameter(negative=(), help="Show every write, and write nothing.")]


@app.command
def dump(node: Node, file: Path, /, *, options: Options = DEFAULT) -> None:
    """Write all settings of a drive to a DCF file.

    Example: `canhelm config dump front_left front_left.dcf`

    Args:
        file: File to write.
    """
    _require_folder(file)
    with options.client() as client:
        show([_save(client.call("config.dump", node=node_of(node)), file)], _files, options.json)


@app.command
def diff(node: Node, file: Path | None = None, /, *, options: Options = DEFAULT) -> int:
    """Compare a drive with a DCF file, or with the profile where no file is given. Exit code 1 where they differ.

    Example: `canhelm config diff front_left front_left.dcf`

    Args:
        file: DCF file.
    """
    with options.client() as client:
        number, text = _number_of(client.status(), node), _text(file)
        values, product = _values(text, number), _product(text)
        found = client.call("config.diff", node=number, values=values, product_code=product)
    _tell(found["notes"])
    show(found["differences"], _changes, options.json)
    say(f"{len(found['differences'])} of {found['compared']} settings differ")
    return 1 if found["differences"] else 0


@app.command
def apply(
    node: Node,
    file: Path | None = None,
    /,
    *,
    dry_run: DryRun = False,
    save: Annotated[bool, Parameter(negative=())] = False,
    options: Options = DEFAULT,
) -> None:
    """Write the settings of a DCF file to a drive, or those of the profile where no file is given; read them back.

    Refused while anything is enabled. Node id and bit rate are never changed.

    Example: `canhelm config apply front_left front_left.dcf --dry-run`

    Args:
        file: DCF file.
        save: Keep them in the drive's non-volatile memory, and restart it.
    """
    with options.client() as client:
        number, text = _number_of(client.status(), node), _text(file)
        params = {"values": _values(text, number), "product_code": _product(text), "dry_run": dry_run, "save": save}
        _report(client.call("config.apply", node=number, **params), options)


@app.command
def backup(folder: Path, node: Node = "all", /, *, options: Options = DEFAULT) -> None:
    """Write the settings of all drives, or of one, into a folder: a DCF file a drive.

    Example: `canhelm config backup settings/`

    Args:
        folder: Folder to write to; it is made where it does not exist.
    """
    _make_folder(folder)
    with options.client() as client:
        drives = client.call("config.backup", node=node_of(node))["drives"]
    show([_save(drive, folder / _file_name(drive["node"])) for drive in drives], _files, options.json)


@app.command
def restore(
    folder: Path,
    node: Node,
    /,
    *,
    dry_run: DryRun = False,
    yes: Annotated[bool, Parameter(negative=())] = False,
    options: Options = DEFAULT,
) -> None:
    """Make a drive like the one that a backup was taken of: write, keep, restart, read back.

    This is what a replaced drive needs, after its node id and bit rate were set. It asks before it writes.

    Example: `canhelm config restore settings/ front_left`

    Args:
        folder: Folder of `canhelm config backup`.
        yes: Do not ask.
    """
    with options.client() as client:
        number = _number_of(client.status(), node)
        text = read_eds_text(folder / _file_name(number))
        _tell(text.warnings)
        params = {"values": _values(text, number), "product_code": _product(text)}
        if dry_run or not yes:
            _report(client.call("config.restore", node=number, dry_run=True, **params), options)
        if not dry_run and (yes or agreed(f"write, save and restart node {number}?")):
            _report(client.call("config.restore", node=number, **params), options)


def _number_of(status: dict[str, Any], node: str) -> int:
    """The node id of a name. Raises NodeAbsent."""
    wanted = node_of(node)
    for found in status["nodes"]:
        if wanted in (found["node"], found["name"]):
            return int(found["node"])
    raise NodeAbsent(f"no node {node} in this profile", remedy="`canhelm status` lists the nodes")


# --- files -----------------------------------------------------------------------------------------------------------


def _file_name(node: int) -> str:
    return f"node-{node}.dcf"


def _text(file: Path | None) -> EdsText | None:
    if file is None:
        return None
    text = read_eds_text(file)
    _tell(text.warnings)
    return text


def _values(text: EdsText | None, node: int) -> dict[str, int] | None:
    """The settings in a file by address. Raises ConfigError where it holds none."""
    if text is None:
        return None
    values = {f"0x{index:04X}/{sub}": value for (index, sub), value in text.values(node).items()}
    if not values:
        raise ConfigError("the file holds no ParameterValue", remedy="give a DCF file; an EDS file holds no settings")
    return values


def _product(text: EdsText | None) -> int | None:
    return text.number("DeviceInfo", "ProductNumber") if text else None


def _require_folder(file: Path) -> None:
    """Raise ConfigError where the folder of a file is missing: it may be a slip of the pen."""
    if not file.parent.is_dir():
        raise ConfigError(f"there is no folder {file.parent} for {file.name}", remedy=f"mkdir -p {file.parent}")


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _not_written(folder, error) from None


def _not_written(path: Path, error: OSError) -> ConfigError:
    return ConfigError(f"{path} cannot be written ({error.strerror})", remedy="choose another place")


def _save(drive: dict[str, Any], file: Path) -> dict[str, Any]:
    """Write the settings of one drive; what was written, for people."""
    found = {parse_address(text): value for text, value in drive["values"].items()}
    values = {address: value for address, value in found.items() if address}
    entries = [entry for entry in SETTINGS if (entry.index, entry.sub) in values]
    commissioning = Commissioning(drive["node"], drive["name"], drive["bit_rate"])
    device = EPOS_24_5.with_product(drive["product_code"])
    try:
        file.write_text(make_dcf(entries, device, commissioning, values), encoding="utf-8")
    except OSError as error:
        raise _not_written(file, error) from None
    return {"node": drive["node"], "name": drive["name"], "file": str(file), "settings": len(values)}


# --- what is said ----------------------------------------------------------------------------------------------------


def _tell(notes: Sequence[str]) -> None:
    for note in notes:
        say(note)


def _report(result: dict[str, Any], options: Options) -> None:
    _tell(result["notes"])
    if wants_json(options.json):
        show(result, json=True)
        return
    show(result["changes"], _changes, options.json)
    done = "would be written" if result["dry_run"] else "written and read back"
    kept = "; saved, restarted, and read back again" if result["saved"] else ""
    say(f"{len(result['changes'])} settings {done}{kept}")
    if not result["dry_run"]:
        say(result["status"])


def _changes(rows: Sequence[dict[str, Any]]) -> Table:
    people = [row | {key: _words(row, key) for key in ("was", "wanted")} for row in rows]
    return _table(people, ("object", "name", "was", "wanted", "note"))


def _words(row: dict[str, Any], key: str) -> str:
    """A value with its unit or its meaning."""
    entry = OBJECTS.find(row["object"])
    return "-" if entry is None else value_words(entry, row[key])


def _files(rows: Sequence[dict[str, Any]]) -> Table:
    return _table(rows, ("node", "name", "file", "settings"))


def _table(rows: Sequence[dict[str, Any]], columns: Sequence[str]) -> Table:
    from rich.table import Table

    table = Table(*columns, box=None, header_style="bold", pad_edge=False)
    for row in rows:
        table.add_row(*(str(row[column]) for column in columns))
    return table
