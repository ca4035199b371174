"""Tokens for clients that come over TCP: a file of lines, each a role and the token that gives it."""

from __future__ import annotations

import hashlib
import hmac
import os
import re
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from canhelm.errors import ConfigError
from daemon.api.parameters import Role

SHORTEST: Final = 32
"""Characters of a token: too many to guess."""
_WORD: Final = re.compile("[a-z]{1,12}")
"""What is shown of a line: a word of this form is a role that was written wrongly, and no part of a token."""
_ROLES: Final = {role.value: role for role in (Role.WATCH, Role.DRIVE, Role.CONFIGURE)}


class Tokens:
    """What gives a role to who knows it.

    Args:
        roles: by token.
    """

    def __init__(self, roles: Mapping[str, Role]) -> None:
        self._roles = {_digest(token): role for token, role in roles.items()}

    def role_of(self, token: str) -> Role | None:
        """The role that a token gives; the time that it takes tells nothing of the tokens."""
        given, found = _digest(token), None
        for digest, role in self._roles.items():
            if hmac.compare_digest(digest, given):
                found = role
        return found


def load_tokens(path: Path) -> Tokens:
    """The tokens of a file that nobody but its owner may read.

    Raises:
        ConfigError: it cannot be read, others may read it, or a line of it is no token.
    """
    try:
        with path.open(encoding="utf-8") as file:
            _require_private(path, os.fstat(file.fileno()))
            lines = file.read(1 << 16).splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no text"
        raise ConfigError(f"the tokens in {path} cannot be read: {reason}", remedy=_cure(path, error)) from None
    roles: dict[str, Role] = {}
    for number, line in enumerate(lines, 1):
        if line.strip():
            _add(roles, f"{path}:{number}", line)
    if not roles:
        raise ConfigError(f"{path} has no token", remedy="write lines as: drive $(openssl rand -hex 32)")
    return Tokens(roles)


def _cure(path: Path, error: OSError | UnicodeDecodeError) -> str:
    if isinstance(error, FileNotFoundError):
        return f'(umask 077; echo "drive $(openssl rand -hex 32)" > {path})'
    if isinstance(error, PermissionError):
        return f"sudo chown {os.getuid()} {path}, and let this user into its folder"
    return "name a file of lines, each a role and a token, with --tokens"


def _require_private(path: Path, found: os.stat_result) -> None:
    if found.st_uid not in (0, os.getuid()):
        raise ConfigError(f"{path} belongs to somebody else", remedy=f"sudo chown {os.getuid()} {path}")
    if stat.S_IMODE(found.st_mode) & 0o077:
        raise ConfigError(f"others than its owner may use {path}", remedy=f"chmod 600 {path}, and make new tokens")


def _add(roles: dict[str, Role], place: str, line: str) -> None:
    word, _, token = line.strip().partition(" ")
    if word not in _ROLES:
        told = f"{word!r} is no role" if _WORD.fullmatch(word) else "no role stands first"
        raise ConfigError(f"{place}: {told}", remedy=f"begin the line with {', '.join(_ROLES)}, a space and the token")
    if len(token) < SHORTEST or not token.isprintable() or " " in token:
        raise ConfigError(
            f"{place}: the token is shorter than {SHORTEST} characters, or has spaces", remedy="openssl rand -hex 32"
        )
    if roles.setdefault(token, _ROLES[word]) != _ROLES[word]:
        raise ConfigError(f"{place}: a line above gives this token another role", remedy="make a token for each role")


def _digest(token: str) -> bytes:
    return hashlib.sha256(token.encode(errors="surrogatepass")).digest()
