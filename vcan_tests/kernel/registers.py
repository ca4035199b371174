"""A library to preload into the user-mode kernel on CPUs whose registers it does not know (see wide_registers.c)."""

from __future__ import annotations

import subprocess
import tempfile
import zlib
from pathlib import Path

from vcan_tests.kernel.errors import MissingTool

SOURCE = Path(__file__).with_name("wide_registers.c")


def needs_wide_registers() -> bool:
    """Whether this CPU has registers beyond AVX-512."""
    return not {"amx_tile", "apx"}.isdisjoint(Path("/proc/cpuinfo").read_text().split())


def wide_registers(cache: Path) -> Path:
    """The library, compiled once for each version of its source.

    Raises:
        MissingTool: the C compiler refused; its words went to stderr.
    """
    library = cache / f"wide_registers-{zlib.crc32(SOURCE.read_bytes()):08x}.so"
    if not library.exists():
        with tempfile.TemporaryDirectory(dir=cache) as folder:
            compiled = Path(folder) / library.name
            if subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", compiled, SOURCE, "-ldl"]).returncode:
                raise MissingTool("cc can't compile what this CPU needs; as root: apt-get install gcc libc6-dev")
            compiled.rename(library)
    return library
