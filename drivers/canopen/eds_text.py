"""The text of EDS and DCF files (CiA 306), mended where vendors write it slightly wrong.

What is mended or left out is told in a warning with its line; nothing raises on what a file holds.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, TypeVar

from canhelm.errors import ConfigError

Address = tuple[int, int]
Key = TypeVar("Key")

MAX_FILE_BYTES = 4_000_000

VAR, ARRAY, RECORD = 0x7, 0x8, 0x9
DOMAIN = 0xF
INTEGERS = {
    0x1: (1, False),
    0x2: (8, True), 0x3: (16, True), 0x4: (32, True), 0x10: (24, True), 0x15: (64, True),
    0x5: (8, False), 0x6: (16, False), 0x7: (32, False), 0x16: (24, False), 0x1B: (64, False),
}  # fmt: skip
"""Data types that are whole numbers (CiA 301 7.4.7.1): bits, signed."""
_FLOATS = (0x8, 0x11)
_TEXTS = (0x9, 0xA, 0xB, DOMAIN)
_KEYS = {
    key.lower(): key
    for key in (
        "ParameterName", "ObjectType", "DataType", "AccessType", "LowLimit", "HighLimit", "DefaultValue",
        "ParameterValue", "PDOMapping", "SubNumber", "CompactSubObj", "StorageLocation", "NodeID", "NodeName",
        "Baudrate", "VendorName", "VendorNumber", "ProductName", "ProductNumber", "RevisionNumber", "OrderCode",
    )
}  # fmt: skip
_GENERAL = {"fileinfo": "FileInfo", "deviceinfo": "DeviceInfo"} | dict.fromkeys(
    ("devicecomissioning", "devicecommissioning"), "DeviceComissioning"
)
_PLAIN_TEXT = frozenset(("VendorName", "ProductName", "OrderCode", "NodeName", "NetworkName"))
_ACCESS = frozenset(("ro", "wo", "rw", "rwr", "rww", "const"))
_HEADER = re.compile(r"\[\s*(?P<name>[^\[\]]*?)\s*(?P<end>\])?\s*$")
_OBJECT = re.compile(r"(?:0x)?(?P<index>[0-9a-f]{4})(?:\s*sub\s*(?P<sub>[0-9a-f]{1,2}))?", re.IGNORECASE)
_NUMBER = re.compile(
    r"(?P<sign>[-+]?)(?:0x(?P<hex>[0-9a-f]+)|(?P<h>[0-9a-f]+)h|(?P<dec>[0-9]+)(?:\.0*)?)", re.IGNORECASE
)
_NODE_ID = re.compile(r"\+?\$NODEID\+?", re.IGNORECASE)


@dataclass(slots=True)
class Section:
    """One section: its values by key, and the lines they stand on."""

    name: str
    line: int
    values: dict[str, str] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)


class EdsText(NamedTuple):
    """A mended file.

    Attributes:
        general: FileInfo, DeviceInfo and DeviceComissioning, those that there are.
        objects: sections of objects by index and sub-index; a record or array itself is at sub-index None.
        warnings: what was mended or left out, each with file and line.
    """

    general: dict[str, Section]
    objects: dict[tuple[int, int | None], Section]
    warnings: tuple[str, ...]

    def text(self) -> str:
        """The file as CiA 306 wants it, records before their entries."""
        ordered = sorted(self.objects.items(), key=lambda item: (item[0][0], -1 if item[0][1] is None else item[0][1]))
        sections = [*self.general.values(), *(section for _, section in ordered)]
        return "\n".join(line for section in sections for line in _section_lines(section)) + "\n"

    def values(self, node: int) -> dict[Address, int]:
        """Every ParameterValue that is a whole number, by index and sub-index, for a node id."""
        found: dict[Address, int] = {}
        for (index, sub), section in self.objects.items():
            value = parse_number(section.values.get("ParameterValue", ""), node)
            if value is not None and _type_of(section) in INTEGERS:
                found[index, sub or 0] = value
        return found

    def number(self, section: str, key: str) -> int | None:
        """A number of a general section, None where it is not given."""
        return parse_number(self.general[section].values.get(key, "")) if section in self.general else None


def parse_number(text: str, node: int = 0) -> int | None:
    """A whole number as people write it: ``0x1F``, ``1Fh``, ``001``, ``0.0``, ``$NODEID+0x200``; None for none."""
    plain = re.sub(r"\s", "", text)
    rest, relative = _NODE_ID.subn("", plain)
    match = _NUMBER.fullmatch(rest or ("0" if relative else ""))
    if match is None or len(plain) > 40:
        return None
    digits, base = next((match[key], 16 if key != "dec" else 10) for key in ("hex", "h", "dec") if match[key])
    value = int(match["sign"] + digits, base)
    return value + node if relative else value


def parse_eds_text(content: bytes, name: str = "file") -> EdsText:
    """Read the text of an EDS or DCF file.

    Args:
        content: the file as it is.
        name: how warnings call it.

    Returns:
        Its sections, mended; never raises.
    """
    reader = _Reader(name)
    reader.read(_decoded(content))
    return reader.mended()


def read_eds_text(path: Path) -> EdsText:
    """The mended text of an EDS or DCF file. Raises ConfigError where it cannot be read or holds no object."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ConfigError(
            f"{path} cannot be read ({error.strerror})", value=str(path), remedy="check the path"
        ) from None
    text = parse_eds_text(content[:MAX_FILE_BYTES], path.name)
    if not text.objects:
        raise ConfigError(f"{path} holds no object", value=str(path), remedy="give an EDS or DCF file (CiA 306)")
    return text


def _decoded(content: bytes) -> str:
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def _section_lines(section: Section) -> list[str]:
    return [f"[{section.name}]", *(f"{key}={value}" for key, value in section.values.items()), ""]


def _type_of(section: Section) -> int:
    return parse_number(section.values.get("DataType", "")) or 0


class _Reader:
    def __init__(self, name: str) -> None:
        self._name = name
        self._general: dict[str, Section] = {}
        self._objects: dict[tuple[int, int | None], Section] = {}
        self._warnings: list[tuple[int, str]] = []

    def _warn(self, line: int, text: str) -> None:
        self._warnings.append((line, text))

    # --- lines ---------------------------------------------------------------------------------------------------

    def read(self, text: str) -> None:
        section = Section("", 0)
        for number, raw in enumerate(re.split(r"\r\n|\r|\n", text), 1):
            line = re.split(r"(?:^|\s);", raw, maxsplit=1)[0].strip()
            if line.startswith("["):
                section = self._begin(line, number)
            elif line and not line.startswith("#"):
                self._entry(section, line, number)

    def _begin(self, line: str, number: int) -> Section:
        match = _HEADER.match(line)
        if match is None:
            self._warn(number, f"{_short(line)} is no section; left out with what follows")
            return Section("", number)
        if not match["end"]:
            self._warn(number, f"{_short(line)} has no closing bracket")
        name = match["name"]
        address = _OBJECT.fullmatch(name)
        section = Section(_GENERAL.get(name.lower(), name), number)
        if address is not None:
            self._begin_object(section, address)
        elif name.lower() in _GENERAL:
            self._put(self._general, section.name, section)
        return section

    def _begin_object(self, section: Section, address: re.Match[str]) -> None:
        index, sub = int(address["index"], 16), int(address["sub"], 16) if address["sub"] else None
        written = section.name
        section.name = f"{index:04X}" + ("" if sub is None else f"sub{sub:X}")
        if written.lower() != section.name.lower():
            self._warn(section.line, f"[{written}] is read as [{section.name}]")
        self._put(self._objects, (index, sub), section)

    def _put(self, where: dict[Key, Section], key: Key, section: Section) -> None:
        first = where.setdefault(key, section)
        if first is not section:
            self._warn(section.line, f"[{section.name}] stands here twice; the first counts (line {first.line})")

    def _entry(self, section: Section, line: str, number: int) -> None:
        key, equals, value = (part.strip() for part in line.partition("="))
        key = _KEYS.get(key.lower(), key)
        if not equals or not key or key.startswith(":"):
            self._warn(number, f"{_short(line)} is neither section nor entry; left out")
        elif key in section.values:
            self._warn(number, f"{key} stands in [{section.name}] twice; the first counts")
        else:
            section.values[key] = value.strip('"') if key in ("ParameterName", *_PLAIN_TEXT) else value
            section.lines[key] = number

    # --- objects -------------------------------------------------------------------------------------------------

    def mended(self) -> EdsText:
        self._general.setdefault("DeviceInfo", Section("DeviceInfo", 1))
        for section in self._general.values():
            self._mend_general(section)
        for (index, sub), section in list(self._objects.items()):
            if sub is not None:
                self._mend_parent(index, section)
        for key in [key for key, section in self._objects.items() if not self._mend_object(key, section)]:
            del self._objects[key]
        warnings = tuple(f"{self._name}:{line}: {text}" for line, text in sorted(self._warnings))
        return EdsText(self._general, self._objects, warnings)

    def _mend_general(self, section: Section) -> None:
        if section.name != "FileInfo":
            for key in [key for key in section.values if key not in _PLAIN_TEXT]:
                self._mend_number(section, key)

    def _mend_parent(self, index: int, section: Section) -> None:
        parent = self._objects.get((index, None))
        if parent is None:
            self._warn(section.line, f"[{section.name}] has no [{index:04X}]; one was added")
            parent = Section(
                f"{index:04X}", section.line, {"ParameterName": f"object_{index:04X}", "ObjectType": "0x9"}
            )
            self._objects[index, None] = parent
        kind = parse_number(parent.values.get("ObjectType", ""))
        if kind not in (ARRAY, RECORD) or "CompactSubObj" in parent.values:
            self._warn(parent.line, f"[{parent.name}] has entries; it is read as a record")
            parent.values.pop("CompactSubObj", None)
            parent.values["ObjectType"] = "0x9"

    def _mend_object(self, key: tuple[int, int | None], section: Section) -> bool:
        """Mend one object; False where too little of it can be read."""
        if not section.values.get("ParameterName"):
            self._warn(section.line, f"[{section.name}] has no ParameterName")
            section.values["ParameterName"] = f"object_{section.name}"
        for number in ("ObjectType", "PDOMapping", "SubNumber", "CompactSubObj"):
            self._mend_number(section, number)
        kind = parse_number(section.values.get("ObjectType", "0x7"))
        if key[1] is None and kind in (ARRAY, RECORD):
            return self._mend_record(section)
        section.values["ObjectType"] = section.values.get("ObjectType", "0x7")
        return self._mend_variable(section)

    def _mend_record(self, section: Section) -> bool:
        if "CompactSubObj" not in section.values:
            return True
        return self._mend_variable(section)

    def _mend_variable(self, section: Section) -> bool:
        self._mend_number(section, "DataType")
        data_type = _type_of(section)
        if "DataType" not in section.values:
            self._warn(section.line, f"[{section.name}] has no DataType; left out")
            return False
        if data_type not in INTEGERS and data_type not in (*_FLOATS, *_TEXTS):
            self._warn(section.lines["DataType"], f"data type 0x{data_type:X} of [{section.name}] is read as bytes")
            section.values["DataType"] = f"0x{DOMAIN:04X}"
        access = section.values.get("AccessType", "").lower()
        if access not in _ACCESS:
            self._warn(section.lines.get("AccessType", section.line), f"[{section.name}] has no AccessType; read as ro")
            access = "ro"
        section.values["AccessType"] = access
        for key in ("LowLimit", "HighLimit", "DefaultValue", "ParameterValue"):
            self._mend_value(section, key, _type_of(section))
        return True

    def _mend_value(self, section: Section, key: str, data_type: int) -> None:
        if not section.values.get(key, "").strip():
            section.values.pop(key, None)
        elif data_type in INTEGERS:
            self._mend_number(section, key, INTEGERS[data_type])
        elif data_type in _FLOATS and _no_float(section.values[key]):
            self._leave_out(section, key, "is no number")

    def _mend_number(self, section: Section, key: str, kind: tuple[int, bool] = (64, False)) -> None:
        """Write a number as CiA 306 does, or leave it out."""
        if key not in section.values:
            return
        text, (bits, signed) = section.values[key], kind
        value = parse_number(text)
        if value is None:
            self._leave_out(section, key, "is no whole number")
            return
        if signed and "x" in text.lower() and value >> (bits - 1) == 1:
            value -= 1 << bits  # a negative number in the two's complement of its type
        low = -(1 << (bits - 1)) if signed else 0
        if not low <= value < low + (1 << bits):
            self._leave_out(section, key, f"does not fit {bits} bits")
            return
        plain = f"$NODEID+0x{value:X}" if "$" in text else str(value)
        if not _is_standard(text):
            self._warn(section.lines[key], f"{key}={_short(text)} in [{section.name}] is read as {plain}")
        section.values[key] = plain

    def _leave_out(self, section: Section, key: str, why: str) -> None:
        text = section.values.pop(key)
        self._warn(section.lines.get(key, section.line), f"{key}={_short(text)} in [{section.name}] {why}; left out")


def _is_standard(text: str) -> bool:
    """Whether CiA 306 allows this way of writing a whole number (it knows octal, which nobody means)."""
    plain = _NODE_ID.sub("", re.sub(r"\s*\+\s*", "+", text.strip()))
    return re.fullmatch(r"|0x[0-9a-f]+|-?(0|[1-9][0-9]*)", plain, re.IGNORECASE) is not None


def _no_float(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return True
    return False


def _short(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "..."
