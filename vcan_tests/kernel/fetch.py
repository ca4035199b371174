"""Where the user-mode kernel and its udev come from: Debian's packages, fetched into a cache, not installed."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from vcan_tests.kernel.errors import MissingTool
from vcan_tests.kernel.registers import needs_wide_registers, wide_registers

PACKAGE, DEVICES = "user-mode-linux", "udev"


@dataclass(frozen=True)
class Kernel:
    """An unpacked user-mode kernel: the program that it is, the folder of its modules, a library to preload if any."""

    program: Path
    modules: Path
    preload: Path | None


def cache() -> Path:
    """The folder for what is worth keeping between runs (XDG Base Directory Specification, XDG_CACHE_HOME)."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "canhelm"


def fetch_kernel() -> Kernel:
    """The kernel of the cache; the first call downloads it (40 MB) with apt, which any user may do.

    Raises:
        MissingTool: it can't be had here.
    """
    root = cache() / PACKAGE
    if not root.exists():
        root.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=root.parent) as folder:
            _unpack(_download(PACKAGE, Path(folder)), Path(folder) / "root")
            _publish(Path(folder) / "root", root)
    return _kernel_in(root)


def fetch_udev() -> Path:
    """The file of Debian's package with the device manager, for a guest with a systemd; downloaded at the first call.

    Raises:
        MissingTool: it can't be had here.
    """
    file = cache() / f"{DEVICES}.deb"
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=file.parent) as folder:
            _download(DEVICES, Path(folder)).rename(file)
    return file


def _download(package: str, folder: Path) -> Path:
    """The package file; the list of packages is fetched first where a machine has none yet."""
    download = ["apt-get", "download", "-qq", package]
    try:
        if subprocess.run(download, cwd=folder, capture_output=True).returncode:
            subprocess.run(["apt-get", "update", "-qq"], check=True)
            subprocess.run(download, cwd=folder, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise MissingTool(
            f"the package {package} can't be downloaded ({error}); on Debian run 'apt-get update' as root and try "
            f"again, elsewhere use a kernel with vcan: modprobe vcan"
        ) from error
    return next(folder.glob(f"{package}_*.deb"))


def _unpack(package: Path, root: Path) -> None:
    subprocess.run(["dpkg", "-x", package, root], check=True)


def _publish(unpacked: Path, root: Path) -> None:
    """One rename, so that nobody sees half a kernel; another run may have been faster."""
    try:
        unpacked.rename(root)
    except OSError:
        if not root.exists():
            raise
        shutil.rmtree(unpacked)


def _kernel_in(root: Path) -> Kernel:
    modules = next((root / "usr/lib/uml/modules").glob("*/kernel"), None)
    program = root / "usr/bin/linux.uml"
    if modules is None or not program.exists():
        raise MissingTool(f"{root} holds no complete kernel: remove the folder and try again")
    return Kernel(program, modules, wide_registers(cache()) if needs_wide_registers() else None)
