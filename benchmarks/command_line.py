"""How long a command takes from its start to its end, and what the libraries take of it that it loads.

Each run is a process of its own, its output a pipe, its files in the page cache, their bytecode written before.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from benchmarks.section import Options, Section, Table
from benchmarks.spread import Spread, spread
from vcan_tests.vcan.bench import Daemon, write_profile

PROGRAM = "import sys; from daemon.__main__ import main; sys.exit(main())"
"""What the installed command ``canhelm`` is."""
STATUS = ("status",)
OWN = "canhelm"
STANDARD, OTHERS = "the standard library", "others"
LEAST_MS = 0.5
"""Packages that take less are counted among the others."""
_OURS = ("canhelm", "daemon", "drivers", "profiles")
_PROJECTS = {"attr": "attrs"}
"""Packages by another name than their project's."""
_LINE = "import time:"
LEAST_RUNS = 3


@dataclass(frozen=True, slots=True)
class Command:
    """One row of the table.

    Attributes:
        words: for people.
        key: in the JSON file.
        code: what Python runs.
        arguments: of ``canhelm``.
        table: for people, drawn by rich, instead of JSON.
    """

    words: str
    key: str
    code: str = PROGRAM
    arguments: tuple[str, ...] = ()
    table: bool = False


COMMANDS = (
    Command("Python alone", "python", "pass"),
    Command("Python that loads cyclopts", "cyclopts", "import cyclopts"),
    Command("canhelm --version", "version", arguments=("--version",)),
    Command("canhelm status", "status", arguments=STATUS),
    Command("canhelm status --json", "status_json", arguments=(*STATUS, "--json")),
    Command("canhelm status, a table (rich)", "status_table", arguments=STATUS, table=True),
    Command("canhelm stop", "stop", arguments=("stop",)),
)


def run(options: Options) -> Section:
    """Each command gets ``options.seconds``, in turn with the others."""
    with TemporaryDirectory() as folder:
        options.tell("boots a simulated robot")
        daemon = Daemon(write_profile(Path(folder)), "simulated", ("--runs", "off"), niceness=0)
        try:
            daemon.wait_for_state("idle")
            environment = _with_bytecode(daemon.environment(), Path(folder))
            spreads = _measure(environment, options)
            options.tell("what is loaded")
            imports = _imports_ms(environment, max(LEAST_RUNS, round(options.seconds)))
        finally:
            daemon.end()
    return Section("command_line", [_commands_table(spreads), _imports_table(imports)], _figures(spreads, imports))


def _with_bytecode(environment: Mapping[str, str], folder: Path) -> dict[str, str]:
    """With bytecode that is kept in a folder of its own, whatever this process does with its own."""
    cleared = {name: value for name, value in environment.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return {**cleared, "PYTHONPYCACHEPREFIX": os.fspath(folder / "bytecode")}


def _measure(environment: Mapping[str, str], options: Options) -> dict[str, Spread]:
    """Wall time [ms] of each command by its key."""
    for command in COMMANDS:
        _run(command, environment)
    found: dict[str, list[float]] = {command.key: [] for command in COMMANDS}
    turns, end_s = 0, time.monotonic() + options.seconds * len(COMMANDS)
    while turns < LEAST_RUNS or time.monotonic() < end_s:
        turns += 1
        options.tell(f"turn {turns}")
        for command in COMMANDS:
            begin_s = time.perf_counter()
            _run(command, environment)
            found[command.key].append(1e3 * (time.perf_counter() - begin_s))
    return {key: spread(times) for key, times in found.items()}


def _run(command: Command, environment: Mapping[str, str], *flags: str) -> str:
    """Carry out a command; what it has said on stderr."""
    shown = {"CANHELM_JSON": "false"} if command.table else {}
    line = (sys.executable, *flags, "-c", command.code, *command.arguments)
    return subprocess.run(line, env={**environment, **shown}, capture_output=True, text=True, check=True).stderr


def _imports_ms(environment: Mapping[str, str], times: int) -> dict[str, float]:
    """What ``status`` loads, by whose it is: medians of the time that its modules take."""
    (status,) = (command for command in COMMANDS if command.key == "status")
    found = [shares_ms(_run(status, environment, "-X", "importtime")) for _ in range(times)]
    return {owner: median(each.get(owner, 0.0) for each in found) for owner in found[0]}


def shares_ms(told: str) -> dict[str, float]:
    """Time that modules take to load, without those that they load in turn, by whose they are; the longest first.

    Args:
        told: what ``python -X importtime`` says.

    Returns:
        canhelm's own, the standard library's, and each other package's.
    """
    shares: Counter[str] = Counter()
    for line in told.splitlines():
        own_us, _, name = line.removeprefix(_LINE).partition("|")
        if line.startswith(_LINE) and own_us.strip().isdecimal():
            shares[_owner(name.rpartition("|")[2].strip())] += int(own_us)
    return {owner: spent_us / 1e3 for owner, spent_us in shares.most_common()}


def _owner(module: str) -> str:
    package = module.partition(".")[0]
    if package in _OURS:
        return OWN
    return STANDARD if package in sys.stdlib_module_names else _PROJECTS.get(package, package)


def _commands_table(spreads: Mapping[str, Spread]) -> Table:
    alone_ms = spreads["python"].p50
    rows: list[Sequence[str | float | None]] = []
    for command in COMMANDS:
        each = spreads[command.key]
        rows.append((command.words, each.p50, each.p99, each.p50 - alone_ms, each.count))
    heads = ("a process", "p50 [ms]", "p99 [ms]", "p50 without Python's own start [ms]", "runs")
    return Table("commands, their output a pipe; p99 of 100 runs or more", heads, rows)


def _imports_table(imports: Mapping[str, float]) -> Table:
    told = {owner: spent_ms for owner, spent_ms in imports.items() if spent_ms >= LEAST_MS}
    every = sum(imports.values())
    rows = [*told.items(), (OTHERS, every - sum(told.values())), ("all", every)]
    return Table("what `canhelm status` loads, as -X importtime finds it", ("modules of", "time [ms]"), rows)


def _figures(spreads: Mapping[str, Spread], imports: Mapping[str, float]) -> dict[str, object]:
    commands = {key: each.figures("ms") for key, each in spreads.items()}
    return {"commands": commands, "status_imports_ms": dict(imports)}
