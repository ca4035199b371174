"""The Debian tools that a guest and the tests in it call."""

from __future__ import annotations

import os
import shutil
import subprocess

from vcan_tests.kernel.errors import MissingTool

PACKAGE_OF = {
    "candump": "can-utils",
    "dbus-daemon": "dbus",
    "halt": "systemd-sysv",
    "insmod": "kmod",
    "ip": "iproute2",
    "socat": "socat",
    "tshark": "tshark",
}


def require_tools() -> None:
    """Installs what is missing of them. Raises MissingTool where it can't be installed from here."""
    require_packages(missing_packages())


def require_packages(packages: list[str]) -> None:
    """Installs Debian packages that are missing, where this process is root and has apt.

    Raises:
        MissingTool: they can't be installed from here.
    """
    if not packages:
        return
    if os.geteuid() != 0 or shutil.which("apt-get") is None:
        raise MissingTool(f"missing tools; as root: apt-get install --no-install-recommends {' '.join(packages)}")
    print(f"installing {', '.join(packages)}", flush=True)
    try:
        _install(packages)
    except subprocess.CalledProcessError as error:
        raise MissingTool(f"apt-get could not install {' '.join(packages)} ({error}); its words stand above") from error


def missing_packages() -> list[str]:
    """The Debian packages of the tools that are not there."""
    places = os.environ.get("PATH", "") + ":/usr/sbin:/sbin"
    missing = {package for tool, package in PACKAGE_OF.items() if shutil.which(tool, path=places) is None}
    if shutil.which("cc") is None:
        missing |= {"gcc", "libc6-dev"}
    return sorted(missing)


def _install(packages: list[str]) -> None:
    command = ["apt-get", "-o", "DPkg::Lock::Timeout=120", "-qq", "-y"]
    quiet = os.environ | {"DEBIAN_FRONTEND": "noninteractive"}
    subprocess.run([*command, "update"], env=quiet, check=True)
    install = [*command, "install", "--no-install-recommends", *packages]
    subprocess.run(install, env=quiet, check=True, stdout=subprocess.DEVNULL)
