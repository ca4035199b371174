"""A command line as a person types it."""

from __future__ import annotations

import subprocess
import sys

from daemon.cli.main import main


def run(line: str) -> int:
    return main(line.split())


def canhelm(line: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "daemon", *line.split()]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
