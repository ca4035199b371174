"""The service's files: what they promise, and what systemd itself thinks of them."""

from __future__ import annotations

import gzip
import os
import re
import shutil
import stat
import subprocess
import sys
from configparser import RawConfigParser
from pathlib import Path

import pytest

from daemon.cli.main import build_app
from daemon.runtime.notify import FEEDS_PER_TIMEOUT

ROOT = Path(__file__).parents[2]
INSTALL = ROOT / "packaging" / "install.sh"
UNINSTALL = ROOT / "packaging" / "uninstall.sh"
UNITS = ("canhelm@.service", "canhelm@.socket", "canhelm-station.service", "can@.service")
MAINTAINER_SCRIPTS = sorted((ROOT / "packaging" / "debian").glob("p*"))
MOST_EXPOSED = 15
"""Ten times the exposure that `systemd-analyze security` may find at most."""


class Unit(RawConfigParser):
    """A unit file; of a key that stands there several times, all values, a line each."""

    def __init__(self, path: Path) -> None:
        super().__init__(strict=False, delimiters=("=",), comment_prefixes=("#",), interpolation=None)
        lines: list[str] = []
        seen: dict[str, int] = {}
        for line in path.read_text().splitlines():
            key, equals, value = line.partition("=")
            if equals and not line.startswith("#") and key in seen:
                lines[seen[key]] += f"\n {value}"
                continue
            if equals and not line.startswith("#"):
                seen[key] = len(lines)
            lines.append(line)
        self.read_string("\n".join(lines))

    def optionxform(self, optionstr: str) -> str:
        """Keys as they are written."""
        return optionstr


def service() -> Unit:
    return Unit(ROOT / "systemd" / "canhelm@.service")


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Everything but the program itself, put together in a folder."""
    folder = tmp_path_factory.mktemp("root")
    _run(INSTALL, folder, "files")
    return folder


def _run(script: Path, folder: Path, *arguments: str, prefix: str = "/opt/canhelm") -> None:
    environment = {**os.environ, "DESTDIR": str(folder), "PREFIX": prefix, "PYTHON": "python3"}
    subprocess.run([str(script), *arguments], env=environment, check=True)


def _files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def test_all_that_the_service_needs_is_installed(installed: Path) -> None:
    wanted = {f"usr/lib/systemd/system/{unit}" for unit in UNITS}
    wanted |= {"usr/lib/sysusers.d/canhelm.conf", "usr/lib/tmpfiles.d/canhelm.conf", "etc/canhelm/canhelm.env"}
    assert wanted < _files(installed)
    assert (installed / "etc" / "canhelm" / "robots").is_dir()


def test_what_is_installed_is_readable_for_everybody(installed: Path) -> None:
    modes = {stat.S_IMODE((installed / name).stat().st_mode) for name in _files(installed)}
    assert modes == {0o644}


@pytest.fixture(scope="module")
def helpful(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Pages and completions, made by a program in its place there."""
    folder = tmp_path_factory.mktemp("root")
    program = folder / "opt/canhelm/bin/python3"
    program.parent.mkdir(parents=True)
    program.write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    program.chmod(0o755)
    _run(INSTALL, folder, "help")
    return folder


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("man/man1/canhelm.1.gz", ".SH SEE ALSO"),
        ("man/man1/canhelm-make-safe.1.gz", "canhelm make\\-safe"),
        ("bash-completion/completions/canhelm", "complete -F"),
        ("zsh/vendor-completions/_canhelm", "#compdef canhelm"),
        ("fish/vendor_completions.d/canhelm.fish", "complete -c canhelm"),
        ("doc/canhelm/reference/commands.md", "### canhelm make-safe"),
    ],
)
def test_pages_and_completions_are_where_shells_and_man_look(helpful: Path, path: str, text: str) -> None:
    content = (helpful / "usr/share" / path).read_bytes()
    told = gzip.decompress(content) if path.endswith(".gz") else content
    assert text in told.decode()


def test_pages_and_completions_are_readable_for_everybody(helpful: Path) -> None:
    modes = {stat.S_IMODE(path.stat().st_mode) for path in (helpful / "usr").rglob("*") if path.is_file()}
    assert modes == {0o644}


def test_uninstalling_takes_pages_and_completions_away(helpful: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(helpful, tmp_path / "copy"))
    _run(UNINSTALL, copy)
    assert _files(copy) == set()


def test_another_prefix_is_in_every_file(tmp_path: Path) -> None:
    _run(INSTALL, tmp_path, "files", prefix="/srv/robot")
    unit = (tmp_path / "usr/lib/systemd/system/canhelm@.service").read_text()
    assert "ExecStart=/srv/robot/bin/canhelm run" in unit
    assert "/opt/canhelm" not in unit


def test_a_second_installation_keeps_the_settings(tmp_path: Path) -> None:
    _run(INSTALL, tmp_path, "files")
    settings = tmp_path / "etc/canhelm/canhelm.env"
    settings.write_text("CANHELM_BUS=socketcan:can1\n")
    _run(INSTALL, tmp_path, "files")
    assert settings.read_text() == "CANHELM_BUS=socketcan:can1\n"


def test_uninstalling_leaves_profiles_and_settings_only(tmp_path: Path) -> None:
    _run(INSTALL, tmp_path, "files")
    (tmp_path / "etc/canhelm/robots/lab1.yaml").write_text("extends: robots/max2d\n")
    _run(UNINSTALL, tmp_path)
    assert _files(tmp_path) == {"etc/canhelm/canhelm.env", "etc/canhelm/robots/lab1.yaml"}


@pytest.mark.parametrize("top", ["home", "root"])
def test_a_python_in_a_folder_that_the_service_cannot_see_is_refused(top: str, tmp_path: Path) -> None:
    python = tmp_path / "python3"
    python.write_text(
        f"#!/bin/sh\nexec {sys.executable} -c \"import sys; sys.base_prefix = '/{top}/ann/python'; $2\"\n"
    )
    python.chmod(0o755)
    environment = {**os.environ, "DESTDIR": str(tmp_path), "PYTHON": str(python)}
    refused = subprocess.run([str(INSTALL)], env=environment, capture_output=True, text=True)
    assert refused.returncode == 1
    assert refused.stderr.startswith(f"{python} lives in a home folder")


@pytest.mark.parametrize("key", ["ExecStart", "ExecReload", "ExecStopPost"])
def test_the_commands_of_the_unit_exist_with_their_options(key: str) -> None:
    for line in service()["Service"][key].splitlines():
        program, *words = line.split()
        if program.endswith("/canhelm"):
            names = [word for word in words if re.fullmatch(r"[a-z][a-z-]+", word)]
            options = [word for word in words if word.startswith("--")]
            command = build_app()
            for name in names:
                command = command[name]
            known = {name for argument in command.assemble_argument_collection() for name in argument.names}
            assert set(options) <= known


def test_the_watchdog_outlasts_what_may_delay_a_cycle() -> None:
    watchdog_s = float(service()["Service"]["WatchdogSec"])
    assert watchdog_s / FEEDS_PER_TIMEOUT >= 0.3


def test_each_directive_left_out_has_its_reason_in_the_unit() -> None:
    text = (ROOT / "systemd" / "canhelm@.service").read_text()
    for directive in ("PrivateNetwork", "PrivateUsers", "RootDirectory", "AF_UNIX", "DeviceAllow", "UMask 0077"):
        assert re.search(rf"^# - .*{directive}", text, re.MULTILINE), directive


@pytest.mark.parametrize("script", [INSTALL, UNINSTALL, ROOT / "packaging" / "deb.sh", *MAINTAINER_SCRIPTS], ids=str)
def test_scripts_are_sound_shell_and_can_be_run(script: Path) -> None:
    subprocess.run(["sh", "-n", str(script)], check=True)
    assert os.access(script, os.X_OK)


@pytest.mark.systemd
@pytest.mark.parametrize(
    "unit", ["canhelm@max2d.service", "canhelm@max2d.socket", "canhelm-station.service", "can@can0.service"]
)
def test_systemd_finds_nothing_to_complain_about(unit: str, tmp_path: Path) -> None:
    _with_stand_in(tmp_path)
    assert _verify(unit, tmp_path) == (0, "")


@pytest.mark.systemd
@pytest.mark.parametrize(
    ("example", "unit", "instance"),
    [
        ("serial.conf", "canhelm@.service", "canhelm@max2d.service"),
        ("tcp.conf", "canhelm@.service", "canhelm@max2d.service"),
        ("real-time.conf", "canhelm@.service", "canhelm@max2d.service"),
        ("station-lan.conf", "canhelm-station.service", "canhelm-station.service"),
    ],
)
def test_systemd_understands_each_drop_in(example: str, unit: str, instance: str, tmp_path: Path) -> None:
    _with_stand_in(tmp_path)
    drop_ins = tmp_path / f"usr/lib/systemd/system/{unit}.d"
    drop_ins.mkdir()
    (drop_ins / example).write_bytes((ROOT / "systemd/examples" / example).read_bytes())
    assert _verify(instance, tmp_path) == (0, "")


def _with_stand_in(folder: Path) -> None:
    """Install units that point to a program that is none."""
    program = folder / "bin" / "canhelm"
    program.parent.mkdir()
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    _run(INSTALL, folder, "files", prefix=str(folder))


def _verify(unit: str, folder: Path) -> tuple[int, str]:
    environment = {**os.environ, "SYSTEMD_UNIT_PATH": f"{folder}/usr/lib/systemd/system:"}
    command = ["systemd-analyze", "verify", "--recursive-errors=yes", "--man=no", unit]
    verified = subprocess.run(command, capture_output=True, text=True, env=environment)
    return verified.returncode, verified.stdout + verified.stderr


@pytest.mark.systemd
@pytest.mark.parametrize("unit", ["canhelm@.service", "canhelm-station.service"])
def test_the_service_is_hardly_exposed(unit: str) -> None:
    command = ["systemd-analyze", "security", "--offline=true", f"--threshold={MOST_EXPOSED}", "--no-pager"]
    analysed = subprocess.run([*command, str(ROOT / "systemd" / unit)], capture_output=True, text=True)
    assert analysed.returncode == 0, analysed.stdout
