"""What a page sends: a request, or nonsense; pure functions."""

from __future__ import annotations

from typing import Any

from canhelm import protocol
from canhelm.errors import UsageError


def parse_request(text: str) -> dict[str, Any]:
    """The request in a message. Raises UsageError where it is none."""
    message = protocol.parse_message(text.encode())
    if isinstance(message, str):
        raise _malformed(message)
    request, params = message.get("id"), message.get("params", {})
    if isinstance(request, bool) or not isinstance(request, int | str | None):
        raise _malformed("id is neither a number nor a string")
    if not isinstance(message.get("method"), str):
        raise _malformed("method is missing or no string")
    if not isinstance(params, dict):
        raise _malformed("params is no object")
    return message


def make_line(request: dict[str, Any]) -> bytes:
    """A request as the one line that the daemon reads, whatever line ends its page wrote.

    Raises:
        UsageError: it is too long, or nested too deeply.
    """
    try:
        line = protocol.make_message(request)
    except RecursionError:
        raise _malformed("it is nested too deeply") from None
    if len(line) > protocol.MAX_REQUEST_BYTES:
        raise _malformed(f"a request is longer than {protocol.MAX_REQUEST_BYTES} bytes")
    return line


def _malformed(reason: str) -> UsageError:
    return UsageError(reason, remedy="send one JSON-RPC 2.0 object a message; api.schema lists the methods")
