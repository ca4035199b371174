"""``canhelm completion``."""

from __future__ import annotations

from typing import Annotated, Literal

from cyclopts import Parameter

from daemon.cli.output import say


def completion(
    shell: Literal["bash", "zsh", "fish"], /, *, install: Annotated[bool, Parameter(negative=())] = False
) -> None:
    """Print the completion script of a shell, or install it for this user.

    Example: `canhelm completion bash --install`

    Parameters
    ----------
    shell: str
        Which shell.
    install: bool
        Write it to where the shell looks for it, and say where that is.
    """
    from daemon.cli.main import build_app

    app = build_app()
    if install:
        say(f"installed: {app.install_completion(shell=shell)}; open a new shell")
    else:
        print(app.generate_completion(shell=shell))
