"""Finds a robot's profile, merges what it extends, checks it, and keeps where every value comes from."""

from __future__ import annotations

import difflib
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from pathlib import Path

import msgspec

from canhelm.errors import ConfigError
from profiles import catalogue, checks, feasibility, own_class
from profiles.provenance import Listing, Mapping, Mistake, Node, Place, Reader, Scalar, leaves, listed, merge
from profiles.schema import Profile
from profiles.shape import Shape

SHIPPED = Path(__file__).resolve().parent
SEARCH: tuple[Path, ...] = (Path(os.environ.get("CANHELM_ROBOTS", "/etc/canhelm/robots")), SHIPPED / "robots")
"""Where a name is looked for: this machine's robots first, then the shipped ones."""
CALIBRATION = ".calibration.yaml"
"""Ending of the side file beside a robot's file that machines write; merged last."""
_PROFILE_TYPE = msgspec.inspect.type_info(Profile)


class ProfileError(ConfigError):
    """A profile with mistakes; the message lists them line by line, each with file:line and what to do."""

    def __init__(self, name: str, mistakes: Sequence[Mistake]) -> None:
        super().__init__(listed(f"profile {name}", mistakes))
        self.mistakes = tuple(mistakes)


@dataclass(frozen=True, slots=True)
class LoadedProfile:
    """A checked profile and where it comes from.

    Attributes:
        profile: the robot.
        path: its own file.
        origin: file:line of every value that a file gives, by dotted path (``drives.rear_left.node``).
        assumed: the part of ``origin`` that carries the tag ``!assumed``.
        warnings: what is allowed and worth knowing, each with file:line.
    """

    profile: Profile
    path: Path
    origin: dict[str, str]
    assumed: dict[str, str]
    warnings: tuple[str, ...]


def load(name_or_path: str | Path, search: Sequence[Path] = SEARCH) -> LoadedProfile:
    """Load a robot's profile.

    Args:
        name_or_path: a name to look for in ``search``, or the path of a YAML file.
        search: folders of robot files, the first match wins.

    Raises:
        ConfigError: the profile is invalid; the message lists every mistake with file:line.
    """
    path = find(name_or_path, search)
    mistakes: list[Mistake] = []
    tree = Assembly(mistakes).robot(path)
    profile, warnings = _checked(tree, mistakes)
    if mistakes or profile is None:
        raise ProfileError(str(name_or_path), _in_order(mistakes, path))
    values = leaves(tree) if tree is not None else []
    origin = {field: str(value.place) for field, value in values}
    assumed = {field: str(value.place) for field, value in values if value.assumed}
    return LoadedProfile(profile, path, origin, assumed, tuple(map(str, warnings)))


def find(name_or_path: str | Path, search: Sequence[Path] = SEARCH) -> Path:
    """The file of a profile: a path as it is, a name by searching.

    Raises:
        ConfigError: there is no such file.
    """
    text = str(name_or_path)
    if "/" in text or text.endswith((".yaml", ".yml")) or isinstance(name_or_path, Path):
        if os.path.isfile(text):
            return Path(text)
        raise ConfigError(f"there is no profile file {text}", value=text, remedy="check the path")
    for folder in search:
        if os.path.isfile(folder / f"{text}.yaml"):
            return folder / f"{text}.yaml"
    known = [path.stem for path in available(search)]
    close = difflib.get_close_matches(text, known, n=1)
    remedy = f"did you mean {close[0]}?" if close else f"known: {', '.join(known)}; or give the path of a YAML file"
    folders = " and ".join(map(str, search))
    raise ConfigError(f"there is no profile named {text!r} in {folders}", value=text, remedy=remedy)


def available(search: Sequence[Path] = SEARCH) -> list[Path]:
    """The robot files that can be loaded by name, in alphabetical order; a name found twice counts once."""
    found: dict[str, Path] = {}
    for folder in search:
        for path in folder.glob("*.yaml"):
            if not path.name.endswith(CALIBRATION):
                found.setdefault(path.stem, path)
    return [found[name] for name in sorted(found)]


class Assembly:
    """Reads a robot's file with all that it extends; mistakes are appended to ``mistakes``."""

    def __init__(self, mistakes: list[Mistake]) -> None:
        self.mistakes = mistakes
        self._resolved: dict[Path, Node | None] = {}
        self._open: list[Path] = []

    def robot(self, path: Path) -> Node | None:
        """The merged tree of a robot's file and its calibration side file; it has a name of its own."""
        tree = self._file(path)
        if isinstance(tree, Mapping):
            tree = _named(tree, path)
        side = path.with_name(path.stem + CALIBRATION)
        calibration = self._file(side) if side.is_file() else None
        return tree if tree is None or calibration is None else merge(tree, calibration)

    def _file(self, path: Path) -> Node | None:
        if path not in self._resolved:
            node = Reader(path, self.mistakes).read()
            if node is not None and not isinstance(node, Mapping):
                self.mistakes.append(Mistake(node.place, "", "is not a mapping", "write 'key: value' lines"))
                node = None
            self._open.append(path)
            self._resolved[path] = None if node is None else self._extended(node, path)
            self._open.pop()
        return self._resolved[path]

    def _extended(self, node: Node, path: Path) -> Node:
        """``node`` with every ``extends:`` in it replaced by what it names."""
        if not isinstance(node, Mapping):
            return node
        entries = {key: self._extended(value, path) for key, value in node.entries.items() if key != "extends"}
        own = Mapping(entries, node.place, node.key_places, node.complete)
        if "extends" not in node.entries:
            return own
        base = self._bases(node.entries["extends"], path)
        return merge(base, own) if base else Mapping(entries, own.place, own.key_places, complete=False)

    def _bases(self, names: Node, path: Path) -> Node | None:
        """What ``extends:`` names, a later name laid over an earlier one; None after a mistake."""
        items = names.items if isinstance(names, Listing) and names.items else (names,)
        bases = [self._base(name, path) for name in items]
        found = [base for base in bases if base is not None]
        return reduce(merge, found) if found and len(found) == len(bases) else None

    def _base(self, name: Node, path: Path) -> Node | None:
        """What ``extends: name`` in the file ``path`` names, or None after a mistake."""
        if not (isinstance(name, Scalar) and isinstance(name.value, str) and name.value):
            self._wrong(name.place, "is not a name", "write the name of a profile file, as devices/ec40")
            return None
        if name.value.startswith(catalogue.PREFIX):
            return self._part(name.value.removeprefix(catalogue.PREFIX), name.place)
        found = [file for file in _candidates(name.value, path) if os.path.isfile(file)]
        if not found:
            self._wrong(name.place, f"there is no file {name.value!r}", _did_you_mean(name.value))
            return None
        base = next((file for file in found if file != path), path)
        if base in self._open:
            chain = " -> ".join(file.stem for file in [*self._open, base])
            self._wrong(name.place, f"goes in a circle: {chain}", "remove one of them")
            return None
        return self._file(base)

    def _part(self, order_number: str, place: Place) -> Node | None:
        part = catalogue.parts().get(order_number)
        if part is None:
            self._wrong(place, f"the catalogue has no {order_number!r}", "`canhelm profile catalogue` lists its parts")
            return None
        return part.data

    def _wrong(self, place: Place, what: str, remedy: str) -> None:
        self.mistakes.append(Mistake(place, "extends", what, remedy))


def _named(tree: Mapping, path: Path) -> Node:
    """A robot whose own file gives it no name is called after that file, and not like the one that it extends."""
    name = tree.entries.get("name")
    if name is not None and name.place.file == str(path):
        return tree
    return merge(tree, Mapping({"name": Scalar(path.stem, tree.place)}, tree.place, {"name": tree.place}))


def _candidates(name: str, path: Path) -> list[Path]:
    """Files that ``extends: name`` in the file ``path`` may mean: beside it, then the shipped ones."""
    file = name if name.endswith((".yaml", ".yml")) else f"{name}.yaml"
    return [path.parent / file, SHIPPED / file, SHIPPED / "robots" / file]


def _did_you_mean(name: str) -> str:
    known = [str(path.relative_to(SHIPPED).with_suffix("")) for path in sorted(SHIPPED.glob("*/*.yaml"))]
    close = difflib.get_close_matches(name, known, n=1)
    return f"did you mean {close[0]}?" if close else f"shipped: {', '.join(known)}"


def _checked(tree: Node | None, mistakes: list[Mistake]) -> tuple[Profile | None, list[Mistake]]:
    """The profile that a tree describes, None when it has mistakes, and warnings."""
    if not isinstance(tree, Mapping):
        return None, []
    data = Shape(mistakes).walk(tree, _PROFILE_TYPE)
    findings = [*checks.findings(data, tree.complete), *feasibility.findings(data), *own_class.findings(data)]
    warnings = [finding.located(tree) for finding in findings if finding.warning]
    mistakes += [finding.located(tree) for finding in findings if not finding.warning]
    return None if mistakes else msgspec.convert(data, Profile), warnings


def _in_order(mistakes: list[Mistake], path: Path) -> list[Mistake]:
    """By file and line, the robot's own file first; one mistake in a file that four drives extend is one mistake."""
    unique: dict[tuple[Place, str], Mistake] = {}
    for mistake in mistakes:
        unique.setdefault((mistake.place, mistake.what), mistake)
    return sorted(
        unique.values(), key=lambda found: (found.place.file != str(path), found.place.file, found.place.line)
    )
