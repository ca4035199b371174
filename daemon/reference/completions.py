"""The completion scripts of all shells, by the names under which shells look for them."""

from __future__ import annotations

from typing import Literal

from daemon.cli.main import build_app

Shell = Literal["bash", "zsh", "fish"]
FILES: dict[Shell, str] = {"bash": "canhelm", "zsh": "_canhelm", "fish": "canhelm.fish"}


def completions() -> dict[str, str]:
    """The script of every shell by its file's name, as ``canhelm completion`` prints it."""
    return {name: build_app().generate_completion(shell=shell) for shell, name in FILES.items()}
