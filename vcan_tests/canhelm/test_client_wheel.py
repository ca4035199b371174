"""The client's own wheel, in an environment beside packages of the same names as those of canhelm."""

from __future__ import annotations

import subprocess
import sys
import sysconfig
import venv
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from canhelm import __version__
from vcan_tests.daemon.test_processes import TIMEOUT_S, Bench

pytestmark = pytest.mark.real_time

ROOT = Path(__file__).parents[2]
PIP = (sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check")
PROGRAM = """
import sys, daemon, drivers
from canhelm.client import Client
with Client(sys.argv[1]) as robot:
    robot.call("steer", pair="front", angle_deg=10)
    print(daemon.OWNER, drivers.OWNER, round(robot.status()["vehicle"]["heading_deg"]["front"]))
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `make client-wheel` builds, with what is installed here."""
    folder = tmp_path_factory.mktemp("dist")
    built = (*PIP, "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder), "packaging/client")
    subprocess.run(built, cwd=ROOT, check=True, timeout=TIMEOUT_S)
    (found,) = folder.iterdir()
    return found


@pytest.fixture(scope="module")
def elsewhere(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of an environment with the client, and with packages `daemon` and `drivers` of somebody else."""
    folder = tmp_path_factory.mktemp("elsewhere")
    venv.create(folder, with_pip=False)
    python = folder / "bin" / "python"
    subprocess.run((*PIP, "--python", str(python), "install", "--no-index", str(wheel)), check=True, timeout=TIMEOUT_S)
    packages = Path(sysconfig.get_path("purelib", vars={"base": str(folder)}))
    assert (packages / "canhelm" / "client.py").exists()
    for name in ("daemon", "drivers"):
        (packages / name).mkdir()
        (packages / name / "__init__.py").write_text("OWNER = 'stranger'\n")
    return python


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[Bench]:
    """A running daemon with a simulated robot."""
    bench = Bench(tmp_path)
    yield bench
    bench.end()


def test_it_holds_the_client_and_nothing_else_of_canhelm(wheel: Path) -> None:
    assert wheel.name == f"canhelm_client-{__version__}-py3-none-any.whl"
    sources = {f"canhelm/{path.name}" for path in (ROOT / "canhelm").iterdir() if path.suffix in (".py", ".typed")}
    with zipfile.ZipFile(wheel) as archive:
        assert {name for name in archive.namelist() if ".dist-info/" not in name} == sources


def test_it_drives_a_robot_beside_other_packages_named_daemon_and_drivers(elsewhere: Path, robot: Bench) -> None:
    program = (str(elsewhere), "-I", "-c", PROGRAM, str(robot.socket))
    done = subprocess.run(program, capture_output=True, text=True, timeout=TIMEOUT_S)
    assert done.stdout.split() == ["stranger", "stranger", "10"], done.stderr
