"""A run, or a log of a bus, as one MCAP file (mcap.dev), which Foxglove, PlotJuggler and Rerun open."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from typing import IO, Any, Final

import msgspec

from canhelm import __version__
from canhelm.errors import CanhelmError, ConfigError, UsageError
from daemon.runs.mcap_bytes import frame_content
from daemon.runs.store import DRIVES, EVENTS, FACTS, FRAMES, PROFILE, RECORDS, TERMS, Run
from daemon.runs.table import read_table
from drivers.bus.candump import LogFrame, parse_line

JSON_LINES: Final = {"/terms": TERMS, "/records": RECORDS, "/events": EVENTS}
"""Files of JSON lines by the names of their channels."""
CYCLES_CHANNEL, FRAMES_CHANNEL = "/cycles", "/frames"
NS: Final = 1e9

Message = tuple[str, float, dict[str, Any]]
"""Channel, seconds since 1970, content."""


def write_mcap(run: Run, path: Path) -> dict[str, int]:
    """Write cycles, terms or records, events and frames of a run as channels of JSON; its YAML files are attachments.

    Args:
        run: which one.
        path: a file that is not there yet.

    Returns:
        Messages of each channel.

    Raises:
        UsageError: the library is missing, or the file is there.
        ConfigError: the run is damaged.
        CanhelmError: the file cannot be written.
    """
    _require_library()
    messages = list(_messages(run))
    attached = {name: run.folder / name for name in (FACTS, PROFILE, DRIVES) if (run.folder / name).is_file()}
    return _write(path, messages, {name: file.read_bytes() for name, file in attached.items()}, _begun_unix_s(run))


def write_log(frames: Iterable[LogFrame], path: Path) -> dict[str, int]:
    """Write the frames of a candump log as a channel of JSON; what it returns and raises is as for a run.

    Args:
        frames: of the log, one at least. What is wrong with the first one is told before there is a file.
        path: a file that is not there yet.
    """
    _require_library()
    left = iter(frames)
    first = next(left)
    return _write(path, map(_frame, chain((first,), left)), {}, first.timestamp_s)


def _require_library() -> None:
    if find_spec("mcap") is None:
        raise UsageError("mcap is not installed", remedy="pip install 'canhelm[mcap]'")


def _write(
    path: Path, messages: Iterable[Message], attached: Mapping[str, bytes], begun_unix_s: float
) -> dict[str, int]:
    try:
        with path.open("xb") as file:
            return _fill(file, messages, attached, begun_unix_s)
    except FileExistsError:
        raise UsageError(f"{path} is there already", value=str(path), remedy="name another file") from None
    except OSError as error:
        raise CanhelmError(
            f"cannot write {path}: {error.strerror}", remedy="name a file in a folder of yours"
        ) from error


def _fill(
    file: IO[bytes], messages: Iterable[Message], attached: Mapping[str, bytes], begun_unix_s: float
) -> dict[str, int]:
    from mcap.writer import Writer

    writer = Writer(file)
    writer.start(library=f"canhelm {__version__}")
    begun_ns = round(begun_unix_s * NS)
    for name, data in attached.items():
        writer.add_attachment(begun_ns, begun_ns, name, "application/yaml", data)
    channels: dict[str, int] = {}
    counts: Counter[str] = Counter()
    for topic, time_s, content in messages:
        if topic not in channels:
            schema = msgspec.json.encode(schema_of(content))
            channels[topic] = writer.register_channel(
                topic, "json", writer.register_schema(f"canhelm.{topic[1:]}", "jsonschema", schema)
            )
        time_ns = round(time_s * NS)
        writer.add_message(channels[topic], time_ns, msgspec.json.encode(content), time_ns, counts[topic])
        counts[topic] += 1
    writer.finish()  # type: ignore[no-untyped-call]
    return dict(counts)


def schema_of(value: Any) -> dict[str, Any]:
    """The JSON Schema of a value as it is; of a list, that of its first item."""
    if isinstance(value, dict):
        return {"type": "object", "properties": {key: schema_of(item) for key, item in value.items()}}
    if isinstance(value, list):
        return {"type": "array", **({"items": schema_of(value[0])} if value else {})}
    if isinstance(value, bool):
        return {"type": "boolean"}
    if isinstance(value, int | float):
        return {"type": "number"}
    return {"type": "string"} if isinstance(value, str) else {}


def _messages(run: Run) -> Iterator[Message]:
    clock_s = run.facts.get("clock_unix_s", _begun_unix_s(run))
    for cycle in _cycles(run):
        yield CYCLES_CHANNEL, clock_s + cycle["time_s"], cycle
    for topic, name in JSON_LINES.items():
        for line in _lines(run.folder / name):
            content = _decoded(line)
            if content is not None:
                yield topic, clock_s + content["time_s"], content
    for line in _lines(run.folder / FRAMES):
        frame = parse_line(line)
        if frame is not None:
            yield _frame(frame)


def _frame(frame: LogFrame) -> Message:
    return FRAMES_CHANNEL, frame.timestamp_s, frame_content(frame.interface, frame.can_id, frame.data)


def _cycles(run: Run) -> Iterator[dict[str, Any]]:
    """Rows with the quantities of each device in an object of its own (``front_left.speed_m_s``)."""
    rows = read_table(run)
    columns = {**rows.numbers, **rows.texts}
    for values in zip(*columns.values(), strict=True):
        row: dict[str, Any] = {}
        for name, value in zip(columns, values, strict=True):
            device, _, quantity = name.rpartition(".")
            (row.setdefault(device, {}) if device else row)[quantity] = value
        yield row


def _lines(path: Path) -> list[str]:
    """Complete lines: the last one of a daemon that was killed may be cut short."""
    return path.read_text(encoding="utf-8").split("\n")[:-1] if path.is_file() else []


def _decoded(line: str) -> dict[str, Any] | None:
    """A line of JSON with a time; None for one that was cut short."""
    try:
        content = msgspec.json.decode(line)
    except (msgspec.DecodeError, RecursionError):
        return None
    timed = isinstance(content, dict) and isinstance(content.get("time_s"), int | float)
    return content if timed else None


def _begun_unix_s(run: Run) -> float:
    begun = run.facts.get("begun_unix_s")
    if not isinstance(begun, int | float) or not math.isfinite(begun):
        raise ConfigError(f"{run.folder / FACTS} does not tell when the run began", remedy="is the run damaged?")
    return float(begun)
