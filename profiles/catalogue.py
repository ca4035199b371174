"""Motors, encoders and gears by maxon order number, for ``extends: catalogue/NUMBER`` in a profile."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from canhelm.errors import ConfigError
from profiles.provenance import Mapping, Mistake, Node, Reader, Scalar, leaves

FILE = Path(__file__).resolve().parent / "catalogue.yaml"
PREFIX = "catalogue/"


@dataclass(frozen=True, slots=True)
class Part:
    """One part.

    Attributes:
        order_number: maxon's.
        kind: ``motor``, ``encoder`` or ``gear``.
        name: what it is, for people.
        source: where its values are from.
        data: the values, with their places.
    """

    order_number: str
    kind: str
    name: str
    source: str
    data: Mapping

    @property
    def assumed(self) -> tuple[str, ...]:
        """Fields that the source does not give."""
        return tuple(field for field, value in leaves(self.data) if value.assumed)


def parts(file: Path = FILE) -> dict[str, Part]:
    """Every part of the catalogue by its order number. Raises ConfigError where the file is broken."""
    mistakes: list[Mistake] = []
    root = Reader(file, mistakes).read()
    if mistakes or not isinstance(root, Mapping):
        raise ConfigError(f"the catalogue is broken: {'; '.join(map(str, mistakes))}", remedy="install canhelm again")
    return {number: _part(number, entry) for number, entry in root.entries.items()}


def _part(number: str, entry: Node) -> Part:
    fields = entry.entries if isinstance(entry, Mapping) else {}
    data = fields.get("data")
    texts = [value.value for key in ("kind", "name", "source") if isinstance(value := fields.get(key), Scalar)]
    if not isinstance(data, Mapping) or len(texts) != 3:
        raise ConfigError(f"{entry.place}: a part has kind, name, source and data", remedy="install canhelm again")
    kind, name, source = map(str, texts)
    return Part(number, kind, name, source, data)
