"""The example programs in other languages, run as their page shows them, with a robot on the kernel's bus."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from vcan_tests.shown import EXAMPLES, alike, shown_output
from vcan_tests.vcan.bench import TIMEOUT_S, Bench, bench, patient

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(120)]

SOCKET = "$XDG_RUNTIME_DIR/canhelm/max2d.sock"
COMPILE = ("cc", "-std=c11", "-D_DEFAULT_SOURCE", "-Wall", "-Wextra", "-Werror")


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    with bench(tmp_path_factory.mktemp("examples"), patient()) as made:
        yield made


def run(*command: str) -> str:
    """What a program says that ends well."""
    program = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S)
    assert (program.returncode, program.stderr) == (0, "")
    return program.stdout


def test_the_shell_drives_a_robot_by_socat(robot: Bench) -> None:
    said = run(str(EXAMPLES / "talk.sh"), str(robot.daemon.socket))
    assert alike(said, shown_output(f"examples/talk.sh {SOCKET}"))


def test_a_program_in_c_drives_a_robot(robot: Bench, tmp_path: Path) -> None:
    run(*COMPILE, "-o", f"{tmp_path}/talk", str(EXAMPLES / "talk.c"))
    said = run(f"{tmp_path}/talk", str(robot.daemon.socket))
    assert alike(said, shown_output(f"./talk {SOCKET}"))
    heading = robot.daemon.status()["vehicle"]["heading_deg"]
    assert (heading["rear"], heading["front"]) == pytest.approx((-20, 20), abs=1)
