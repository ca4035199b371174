"""What commands load: those of every day no more than the parser, and none of the daemon's libraries."""

from __future__ import annotations

import subprocess
import sys

from daemon.api.server import Server

LIGHT = (
    "--version",
    "version",
    "status",
    "stop",
    "estop",
    "reset",
    "steer front 5 --no-wait",
    "drive turn --rear 1 --front 2 --speed 0.1 --duration 0.01",
    "motor velocity 1 5 --duration 0.01",
    "motor stop 1",
    "brake engage",
    "nmt start 1",
    "sdo read 1 0x6041",
    "sim fault silence 1",
)
PARSER = {"cyclopts", "attr", "attrs"}
"""The library that reads the command line, and what it stands on."""
CODE = """
import sys
begin = set(sys.modules)
from daemon.cli.main import main
for line in sys.argv[1:]:
    assert main(line.split()) == 0, line
print(*set(sys.modules) - begin, file=sys.stderr)
"""


def loaded_by(*lines: str) -> set[str]:
    """Modules that a process has loaded in the end which carried out these commands, its stdout a pipe."""
    done = subprocess.run([sys.executable, "-c", CODE, *lines], capture_output=True, text=True, check=True)
    return set(done.stderr.splitlines()[-1].split())


def test_the_commands_of_every_day_load_the_parser_and_no_other_library(server: Server) -> None:
    packages = {module.partition(".")[0] for module in loaded_by(*LIGHT)}
    assert packages - sys.stdlib_module_names - {"canhelm", "daemon"} == PARSER


def test_a_completion_script_is_made_without_the_libraries_of_the_daemon() -> None:
    packages = {module.partition(".")[0] for module in loaded_by("completion bash")}
    assert not packages & {"numpy", "canopen", "can", "matplotlib", "rich"}


def test_a_look_at_the_status_does_without_the_heavier_rooms_of_the_standard_library(server: Server) -> None:
    assert not loaded_by("status") & {"asyncio", "logging", "subprocess", "argparse", "concurrent.futures"}
