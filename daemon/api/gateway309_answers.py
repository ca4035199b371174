r"""The answers of the CiA 309-3 ASCII gateway. Pure.

Error numbers are those of CiA 309-3; the forms are the ones that CANopenNode's clients look for: one line, ended by
``\r\n``, written in one piece.
"""

from __future__ import annotations

from enum import IntEnum

from drivers.canopen.codes import SDO_ABORTS


class ErrorNumber(IntEnum):
    """Error numbers of the gateway (CiA 309-3, internal error codes) that this one sends."""

    NOT_SUPPORTED = 100
    SYNTAX = 101
    INTERNAL_STATE = 102
    TIME_OUT = 103
    NO_DEFAULT_NODE = 105
    UNSUPPORTED_NET = 106
    UNSUPPORTED_NODE = 107
    LSS_VENDOR = 501
    LSS_NODE_ID = 502
    LSS_BIT_RATE = 503
    LSS_STORE = 504
    LSS_MEDIA = 505


ERROR_TEXTS = {
    ErrorNumber.NOT_SUPPORTED: "request not supported",
    ErrorNumber.SYNTAX: "syntax error",
    ErrorNumber.INTERNAL_STATE: "not possible in the present state",
    ErrorNumber.TIME_OUT: "no answer in time",
    ErrorNumber.NO_DEFAULT_NODE: "no node given, and none set by `set node`",
    ErrorNumber.UNSUPPORTED_NET: "networks are 0 to 65535",
    ErrorNumber.UNSUPPORTED_NODE: "no such node id",
    ErrorNumber.LSS_VENDOR: "LSS: the device refused with an error of its own",
    ErrorNumber.LSS_NODE_ID: "LSS: the device does not take this node id",
    ErrorNumber.LSS_BIT_RATE: "LSS: the device does not have this bit rate",
    ErrorNumber.LSS_STORE: "LSS: the device cannot store its configuration",
    ErrorNumber.LSS_MEDIA: "LSS: the device's memory failed",
}


class GatewayError(Exception):
    """A request that is answered with an error number; never leaves the gateway.

    Args:
        number: what is wrong.
        detail: what is wrong, in words; empty where the number says it.
    """

    def __init__(self, number: ErrorNumber, detail: str = "") -> None:
        super().__init__(number, detail)
        self.number = number
        self.detail = detail


EMPTY = b"\r\n"
"""The answer to an empty line or a comment."""


def make_value(sequence: int, text: str) -> bytes:
    """The answer with a value. Lines of a longer text are parted by ``\\n``; the ``\\r\\n`` at the end ends it."""
    return f"[{sequence}] {text}\r\n".encode("latin-1", "replace")


def make_error(sequence: int, number: ErrorNumber, detail: str = "") -> bytes:
    """The answer to what the gateway refuses, with what is wrong in words after ``#``."""
    return make_value(sequence, f"ERROR:{number} #{printable(detail or ERROR_TEXTS[number])}")


def make_abort(sequence: int, code: int) -> bytes:
    """The answer to a transfer that ended with an SDO abort code (CiA 301 7.2.4.3.17)."""
    known = SDO_ABORTS.get(code)
    return make_value(sequence, f"ERROR:0x{code:08X} #{known.name if known else 'abort code of the device'}")


def printable(text: str) -> str:
    """A text for one line: everything but printable ASCII becomes ``?``."""
    return "".join(letter if " " <= letter <= "~" else "?" for letter in text)
