"""What is checked of every request before it is looked at, and what every answer says.

A browser carries requests of any page that its person looks at. That the name in ``Host`` is one of this machine keeps
pages out that have their own name lead here (DNS rebinding); that ``Origin`` and ``Sec-Fetch-Site`` name no other page
keeps out the others (Fetch Metadata Request Headers, W3C).
"""

from __future__ import annotations

import ipaddress
import re
import socket
from typing import Final

from aiohttp import web

from canhelm.errors import CanhelmError, PermissionRefused

HEADERS: Final = {
    "Content-Security-Policy": "default-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "Server": "canhelm",
    "X-Content-Type-Options": "nosniff",
}
EVERYWHERE: Final = ("0.0.0.0", "::")
"""Addresses of a server that listens on all addresses of its machine."""
_HOST: Final = re.compile(r"(?:\[([0-9a-f:.]+)\]|([a-z0-9._-]+))(?::[0-9]{1,5})?", re.ASCII)
"""An address of IPv6, or a name or another address; perhaps with a port (RFC 9110, 7.2)."""
_ELSEWHERE: Final = ("192.0.2.1", 9)
"""An address that nobody has (RFC 5737)."""
_OWN_PAGES: Final = ("same-origin", "none")
"""``Sec-Fetch-Site`` of the station's own page, and of an address that a person has typed."""


class Guard:
    """Who may ask.

    Args:
        host: address or name that the station listens on.
    """

    def __init__(self, host: str) -> None:
        self.on_loopback = is_loopback(host)
        machine = socket.gethostname().lower()
        self._names = {"localhost"} if self.on_loopback else {"localhost", host.lower(), machine, f"{machine}.local"}

    def refusal(self, request: web.Request) -> CanhelmError | None:
        """Why a request is not looked at; None for one that is."""
        host = request.headers.get("Host", "")
        if not self.is_here(host):
            name = host[:80]
            return PermissionRefused(f"{name!r} is no name of this station", remedy="use the address that it printed")
        origin = request.headers.get("Origin")
        if origin is not None and origin != f"http://{host}":
            return PermissionRefused("another page may not use this station", remedy="open the station's own page")
        if request.headers.get("Sec-Fetch-Site", "none") not in _OWN_PAGES and not _opens_page(request):
            return PermissionRefused("another page may not use this station", remedy="open the station's own page")
        return None

    def is_here(self, host: str) -> bool:
        """Whether a ``Host`` is this machine. No page of a stranger has a bare address for its name."""
        found = _HOST.fullmatch(host.lower())
        name = (found[1] or found[2]).rstrip(".") if found else ""
        if name in self._names:
            return True
        return is_loopback(name) if self.on_loopback else _is_address(name)


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches an address."""
    return host == "localhost" or (_is_address(host) and ipaddress.ip_address(host).is_loopback)


def own_address() -> str:
    """The address by which this machine would talk to others, or its name where it could not. Nothing is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_ELSEWHERE)
        except OSError:
            return socket.gethostname()
        return str(probe.getsockname()[0])


async def say_what_is_allowed(request: web.Request, answer: web.StreamResponse) -> None:
    """Put the headers of every answer into one."""
    answer.headers.update(HEADERS)
    answer.headers.setdefault("Cache-Control", "no-cache" if request.path.startswith("/page/") else "no-store")


def _opens_page(request: web.Request) -> bool:
    """Whether a link on another page leads to the station's page."""
    return request.path == "/" and request.headers.get("Sec-Fetch-Mode") == "navigate"


def _is_address(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True
