"""``canhelm completion``."""

from __future__ import annotations

from typing import Annotated, Literal

from cyclopts import Parameter

from canhelm.errors import ConfigError
from daemon.cli.output import say

STARTUP = {"bash": "; ~/.bashrc loads it", "zsh": "; ~/.zshrc has its folder in fpath", "fish": ""}
"""What the installation writes besides the script, where the line is not there yet."""


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
        Write it to where the shell looks for it, add the line that loads it to ~/.bashrc or ~/.zshrc, and say so.
    """
    from daemon.cli.main import build_app

    app = build_app()
    if install:
        try:
            say(f"installed: {app.install_completion(shell=shell)}{STARTUP[shell]}; open a new shell")
        except OSError as error:
            raise ConfigError(
                f"the completion cannot be installed: {error.filename}: {error.strerror}",
                remedy=f"write it to a place of your own: canhelm completion {shell} > FILE",
            ) from None
    else:
        print(app.generate_completion(shell=shell))
