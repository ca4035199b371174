"""What a long life takes: memory, tasks, file descriptors and logs, as one sees them who keeps nothing."""

from __future__ import annotations

import asyncio
import ctypes
import gc
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import msgspec

LOGS, RUNS = "record", "runs"
_PAGE_KIB: Final = os.sysconf("SC_PAGE_SIZE") // 1024


@dataclass(frozen=True, slots=True)
class Sample:
    """One look at a process whose robot rests and whose clients have gone.

    Attributes:
        time_s: virtual time.
        memory_kib: resident memory.
        heap_kib: that the C library has given out and not got back; 0 where it does not say.
        objects: that the garbage collector knows, after a collection.
        blocks: of memory that Python uses; with those that no collector knows, as numbers and short strings.
        tasks: of the loop.
        descriptors: that are open.
        log_bytes: of the continuous record.
        run_bytes: of all runs.
        faults: that were struck so far.
        kinds: of what has happened so far.
    """

    time_s: float
    memory_kib: int
    heap_kib: int
    objects: int
    blocks: int
    tasks: int
    descriptors: int
    log_bytes: int
    run_bytes: int
    faults: int
    kinds: int


def take_sample(folder: Path, counts: Mapping[str, int]) -> Sample:
    """Look at this process now.

    Args:
        folder: of its logs and runs.
        counts: what has happened, by name.
    """
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return Sample(
        round(asyncio.get_running_loop().time(), 3),
        pages * _PAGE_KIB,
        _heap_kib(),
        len(gc.get_objects()),
        sys.getallocatedblocks(),
        len(asyncio.all_tasks()),
        len(os.listdir("/proc/self/fd")),
        _size(folder / LOGS),
        _size(folder / RUNS),
        counts.get("fault", 0),
        len(counts),
    )


def write_sample(path: Path, sample: Sample) -> None:
    """Append a sample to a file: kept in memory, samples would be what grows."""
    with path.open("ab") as file:
        file.write(msgspec.json.encode(sample) + b"\n")


def read_samples(path: Path) -> list[Sample]:
    """All that were written."""
    return [msgspec.json.decode(line, type=Sample) for line in path.read_bytes().splitlines()]


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


_SIZES: Final = "arena ordblks smblks hblks hblkhd usmblks fsmblks uordblks fordblks keepcost"


class _Mallinfo2(ctypes.Structure):
    _fields_ = tuple((name, ctypes.c_size_t) for name in _SIZES.split())


_mallinfo2 = getattr(ctypes.CDLL(None), "mallinfo2", None)
if _mallinfo2 is not None:
    _mallinfo2.restype = _Mallinfo2


def _heap_kib() -> int:
    """Bytes in use of malloc's arenas and of its blocks with a mapping of their own (mallinfo2(3), glibc 2.33)."""
    if _mallinfo2 is None:
        return 0
    info = _mallinfo2()
    return int(info.uordblks + info.hblkhd) // 1024
