"""What clients of a CiA 309-3 gateway rely on: the grammar of an answer, and how CANopenNode's ``cocomm`` reads one."""

from __future__ import annotations

import re
from typing import NamedTuple

ANSWER = re.compile(
    rb"\r\n"
    rb"|\[(?P<sequence>0|[1-9][0-9]{0,9})\] "
    rb"(?:OK|ERROR:(?P<number>[1-9][0-9]{2}) #[ -~]+|ERROR:0x(?P<abort>[0-9A-F]{8}) #[ -~]+|(?P<value>[^\r]*))\r\n"
)
"""An answer, whole: of CiA 309-3 with the error text that CANopenNode adds."""


class Heard(NamedTuple):
    """What ``cocomm`` makes of an answer.

    Attributes:
        kind: ``ok``, ``error`` or ``value``.
        text: what it prints as data; empty unless a value.
    """

    kind: str
    text: str = ""


def cocomm(first_read: bytes) -> Heard:
    """Read an answer as ``cocomm`` does, which decides by what its first ``read`` of up to 1000 bytes returns.

    Raises:
        AssertionError: it would wait for more.
    """
    assert len(first_read) <= 1000, "cocomm needs another read"
    text = first_read.decode("latin-1")
    assert "\r\n" in text, "cocomm waits for the end of the line"
    if "] ERROR:" in text:
        return Heard("error")
    if "] OK\r\n" in text:
        return Heard("ok")
    head = text.find("] ")
    return Heard("value", text[head + 2 if 0 <= head < 15 else 0 : text.index("\r\n")])
