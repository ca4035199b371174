"""Who may use the station: a token shown once gives a session, and the session its role."""

from __future__ import annotations

import asyncio
import logging
import secrets
from typing import Final

from canhelm.errors import CanhelmError, PermissionRefused, Refused
from daemon.api.parameters import Role
from daemon.api.tokens import Tokens

LOGGER: Final = logging.getLogger("canhelm.station")
MAX_SESSIONS: Final = 256
"""Above this the oldest one ends."""
MAX_WAITING: Final = 8
"""Wrong tokens that wait for their answer."""
WRONG_S: Final = 1.0
"""How long one with a wrong token waits for its answer."""


class Sessions:
    """The sessions that were begun since the station was started.

    Args:
        tokens: that begin one; None: nobody needs one, and everybody may do what the station's user may.
    """

    def __init__(self, tokens: Tokens | None) -> None:
        self._tokens = tokens
        self._roles: dict[str, Role] = {}
        self._waiting = 0

    @property
    def needed(self) -> bool:
        """Whether a session is needed."""
        return self._tokens is not None

    def role_of(self, session: str | None) -> Role | None:
        """The most that somebody with this session may do; None: nothing at all."""
        if self._tokens is None:
            return Role.CONFIGURE
        return self._roles.get(session) if session else None

    async def begin(self, token: str, host: str) -> str:
        """A new session.

        Args:
            token: that somebody has shown.
            host: where they are, for the log.

        Raises:
            PermissionRefused: the token is wrong; that takes a second.
            Refused: too many wrong ones wait for that.
        """
        role = self._tokens.role_of(token) if self._tokens else Role.CONFIGURE
        if role is None:
            raise await self._wrong(host)
        if len(self._roles) >= MAX_SESSIONS:
            del self._roles[next(iter(self._roles))]
        session = secrets.token_urlsafe(32)
        self._roles[session] = role
        return session

    def end(self, session: str | None) -> None:
        """Forget a session."""
        if session:
            self._roles.pop(session, None)

    async def _wrong(self, host: str) -> CanhelmError:
        if self._waiting >= MAX_WAITING:
            return Refused("too many wrong tokens at once", remedy="try again in a second")
        LOGGER.warning("somebody at %s showed a wrong token", host)
        self._waiting += 1
        try:
            await asyncio.sleep(WRONG_S)
        finally:
            self._waiting -= 1
        return PermissionRefused("the token is wrong", remedy="give one of the station's --tokens file")
