"""The grammar of the CiA 309-3 ASCII gateway: what a request line says. Pure.

A request is ``"[" sequence "]" [[net] node] command``, one a line; ``#`` begins a comment. Numbers are written as in C.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from daemon.api.gateway309_answers import ErrorNumber, GatewayError, printable
from daemon.api.gateway309_types import HEX, VALUE_TYPES, ValueType, parse_number
from drivers.canopen.codes import NmtCommand

MAX_LINE_BYTES = 2000
"""Longest request, with its end of line."""
MAX_TOKEN = 20
"""Longest word of a request; values of variable length are no words."""
_U32 = 0xFFFF_FFFF
_TOKEN = re.compile(r"[^ \t\v\f\r]+")
_BLANKS = " \t\v\f\r"
_BEFORE_COMMENT = re.compile(r'(?:[^"#]|"[^"]*")*')


@dataclass(frozen=True, slots=True)
class Read:
    """``r[ead] index sub [datatype]``."""

    index: int
    sub: int
    datatype: ValueType


@dataclass(frozen=True, slots=True)
class Write:
    """``w[rite] index sub datatype value``; ``data`` are the bytes of the value."""

    index: int
    sub: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Nmt:
    """``start``, ``stop``, ``preop``, ``reset node`` or ``reset comm``."""

    command: NmtCommand


@dataclass(frozen=True, slots=True)
class Set:
    """``set network|node|sdo_timeout|sdo_block value``."""

    item: str
    value: int


@dataclass(frozen=True, slots=True)
class Lss:
    """One of the ``lss_`` commands with its numbers."""

    name: str
    numbers: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Tell:
    """``help``, ``info version``, ``led`` or ``log``: text about the gateway itself."""

    what: str
    topic: str = ""


Command = Read | Write | Nmt | Set | Lss | Tell


@dataclass(frozen=True, slots=True)
class Request:
    """One request.

    Attributes:
        sequence: number that its answer carries.
        node: 0 (all) to 127; None where the default holds.
    """

    sequence: int
    node: int | None
    command: Command


@dataclass(frozen=True, slots=True)
class Refusal:
    """A line that is no request.

    Attributes:
        sequence: its number; None where not even that could be read.
        number: what is wrong.
        detail: what is wrong, in words; empty where the number says it.
    """

    sequence: int | None
    number: ErrorNumber
    detail: str = ""


def parse_request(line: bytes) -> Request | Refusal | None:
    """The request in a line without its ``\\n``.

    Args:
        line: any bytes.

    Returns:
        The request, the reason why it is none, or None for a line that is empty or only a comment.
    """
    words = _Words(_without_comment(line[:MAX_LINE_BYTES].decode("latin-1")))
    if words.at_end:
        return None
    sequence: int | None = None
    try:
        sequence = _sequence(words.next())
        if len(line) >= MAX_LINE_BYTES:
            raise GatewayError(ErrorNumber.SYNTAX, f"a line has less than {MAX_LINE_BYTES} bytes")
        node, name = _node_and_name(words)
        command = _command(name, words, node)
    except GatewayError as error:
        return Refusal(sequence, error.number, error.detail)
    return Request(sequence, node, command)


def _without_comment(text: str) -> str:
    """The text before a ``#`` that is not in double quotes; an open quote quotes the rest of the line."""
    found = _BEFORE_COMMENT.match(text)
    assert found is not None
    return text if text[found.end() : found.end() + 1] == '"' else found[0]


class _Words:
    """The words of a line, one after the other."""

    def __init__(self, text: str) -> None:
        self._text = text.strip(_BLANKS)

    @property
    def at_end(self) -> bool:
        return not self._text

    def next(self) -> str:
        found = _TOKEN.match(self._text)
        if found is None:
            raise GatewayError(ErrorNumber.SYNTAX, "something is missing")
        if len(found[0]) > MAX_TOKEN:
            raise GatewayError(ErrorNumber.SYNTAX, f"a word has at most {MAX_TOKEN} characters")
        self._text = self._text[found.end() :].lstrip(_BLANKS)
        return found[0]

    def keyword(self) -> str:
        return self.next().lower()

    def number(self, low: int, high: int) -> int:
        word = self.next()
        value = parse_number(word)
        if value is None or not low <= value <= high:
            raise GatewayError(ErrorNumber.SYNTAX, f"{printable(word)} is no number from {low} to {high}")
        return value

    def rest(self) -> str:
        rest, self._text = self._text, ""
        return rest

    def end(self) -> None:
        if self._text:
            raise GatewayError(ErrorNumber.SYNTAX, "the line goes on after the end of the command")


def _sequence(word: str) -> int:
    value = parse_number(word[1:-1]) if word.startswith("[") and word.endswith("]") else None
    if value is None or not 0 <= value <= _U32:
        raise GatewayError(ErrorNumber.SYNTAX, "a request begins with its number in brackets: [1] 4 read 0x1000 0")
    return value


def _node_and_name(words: _Words) -> tuple[int | None, str]:
    """The node, if one is given, and the word of the command. There is one network; its number does not matter."""
    numbers: list[int] = []
    word = words.next()
    while word[0] in "0123456789":
        value = parse_number(word)
        if value is None or len(numbers) == 2:
            raise GatewayError(ErrorNumber.SYNTAX, "before the command stand at most a network and a node")
        numbers.append(value)
        word = words.next()
    if len(numbers) == 2 and numbers[0] > 0xFFFF:
        raise GatewayError(ErrorNumber.UNSUPPORTED_NET)
    if numbers and numbers[-1] > 127:
        raise GatewayError(ErrorNumber.UNSUPPORTED_NODE, f"{numbers[-1]} is above 127")
    return (numbers[-1] if numbers else None), word.lower()


def _command(name: str, words: _Words, node: int | None) -> Command:
    parse = _COMMANDS.get(name)
    if parse is None:
        raise GatewayError(ErrorNumber.NOT_SUPPORTED, f"no command {printable(name)}; `help` lists them")
    if parse in (_read, _write) and node == 0:
        raise GatewayError(ErrorNumber.UNSUPPORTED_NODE, "objects are read and written at nodes 1 to 127")
    command = parse(name, words)
    words.end()
    return command


def _read(name: str, words: _Words) -> Command:
    index, sub = words.number(0, 0xFFFF), words.number(0, 0xFF)
    return Read(index, sub, HEX if words.at_end else _datatype(words))


def _write(name: str, words: _Words) -> Command:
    index, sub, datatype = words.number(0, 0xFFFF), words.number(0, 0xFF), _datatype(words)
    data = datatype.from_text(words.next() if datatype.size else words.rest())
    if data is None:
        raise GatewayError(ErrorNumber.SYNTAX, f"the value is no {datatype.name}; `help datatype` explains")
    return Write(index, sub, data)


def _datatype(words: _Words) -> ValueType:
    datatype = VALUE_TYPES.get(words.keyword())
    if datatype is None:
        raise GatewayError(ErrorNumber.SYNTAX, "no such datatype; `help datatype` lists them")
    return datatype


_NMT = {
    "start": NmtCommand.START,
    "stop": NmtCommand.STOP,
    "preop": NmtCommand.ENTER_PRE_OPERATIONAL,
    "preoperational": NmtCommand.ENTER_PRE_OPERATIONAL,
}
_RESETS = {
    "node": NmtCommand.RESET_NODE,
    "comm": NmtCommand.RESET_COMMUNICATION,
    "communication": NmtCommand.RESET_COMMUNICATION,
}
_SETTINGS = {"network": (0, 0xFFFF), "node": (1, 127), "sdo_timeout": (1, 0xFFFF), "sdo_block": (0, 1)}
_TOPICS = {"help": ("", "datatype", "lss"), "info": ("version",), "led": ("",), "log": ("",)}


def _nmt(name: str, words: _Words) -> Command:
    return Nmt(_NMT[name])


def _reset(name: str, words: _Words) -> Command:
    command = _RESETS.get(words.keyword())
    if command is None:
        raise GatewayError(ErrorNumber.SYNTAX, "reset what: node or communication?")
    return Nmt(command)


def _set(name: str, words: _Words) -> Command:
    item = words.keyword()
    if item not in _SETTINGS:
        raise GatewayError(ErrorNumber.NOT_SUPPORTED, f"what can be set: {', '.join(_SETTINGS)}")
    return Set(item, words.number(*_SETTINGS[item]))


def _tell(name: str, words: _Words) -> Command:
    topic = "" if words.at_end else words.keyword()
    if topic not in _TOPICS[name]:
        unknown = ErrorNumber.NOT_SUPPORTED if name == "info" else ErrorNumber.SYNTAX
        raise GatewayError(unknown, f"{name} knows: {', '.join(_TOPICS[name]) or 'nothing to follow'}")
    return Tell(name, topic)


_IDENTITY = ((0, _U32),) * 4
_ALL_NODES = ((0, 0xFFFF), (1, 127), (0, 1), *((0, 2), (0, _U32)) * 4)
_LSS: dict[str, tuple[tuple[tuple[int, int], ...], tuple[int, ...]]] = {
    "lss_switch_glob": (((0, 1),), (1,)),
    "lss_switch_sel": (_IDENTITY, (4,)),
    "lss_set_node": (((0, 255),), (1,)),
    "lss_conf_bitrate": (((0, 0), (0, 9)), (2,)),
    "lss_activate_bitrate": (((0, 0xFFFF),), (1,)),
    "lss_store": ((), (0,)),
    "lss_inquire_addr": (((0, 3),), (0, 1)),
    "lss_get_node": ((), (0,)),
    "_lss_fastscan": (((0, 0xFFFF),), (0, 1)),
    "lss_allnodes": (_ALL_NODES, (0, 1, 3, 11)),
}
"""The numbers of each LSS command: their ranges in order, and how many there may be."""


def _lss(name: str, words: _Words) -> Command:
    ranges, counts = _LSS[name]
    numbers: list[int] = []
    while not words.at_end and len(numbers) < len(ranges):
        numbers.append(words.number(*ranges[len(numbers)]))
    if len(numbers) not in counts:
        raise GatewayError(ErrorNumber.SYNTAX, "something is missing; `help lss` explains")
    if name == "lss_set_node" and 127 < numbers[0] < 255:
        raise GatewayError(ErrorNumber.SYNTAX, "node ids are 1 to 127, or 255 for none")
    if name == "lss_conf_bitrate" and numbers[1] == 5:
        raise GatewayError(ErrorNumber.SYNTAX, "5 is reserved in the table of bit rates")
    return Lss(name, tuple(numbers))


_COMMANDS: dict[str, Callable[[str, _Words], Command]] = {
    **dict.fromkeys(("r", "read"), _read),
    **dict.fromkeys(("w", "write"), _write),
    **dict.fromkeys(_NMT, _nmt),
    "reset": _reset,
    "set": _set,
    **dict.fromkeys(_TOPICS, _tell),
    **dict.fromkeys(_LSS, _lss),
}
