"""``canhelm run``: how a daemon begins, what it refuses, and how it ends."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import astuple, replace
from pathlib import Path

import pytest

from canhelm.errors import ConfigError, UsageError
from daemon.api.peers import Groups
from daemon.app import App, GatewayAccess, TcpAccess
from daemon.cli.main import main
from daemon.cli.run import tcp_access
from daemon.life import Life
from daemon.runtime.notify import ServiceManager
from profiles.loader import load
from profiles.schema import Profile
from vcan_tests.robot import Robot

SIMULATED = ("run", "--simulate", "--profile", "max2d")


async def _begin(socket: Path) -> asyncio.Task[str]:
    """A daemon that runs as in a terminal, after its first cycle."""

    async def load_anew() -> Profile:
        return load("max2d").profile

    life = Life(lambda profile: App(profile, socket=socket, powered=False), load_anew, ServiceManager())
    life.take_signals()
    running = asyncio.create_task(life.run(load("max2d").profile))
    await asyncio.sleep(0)
    await Robot(life.app).until(lambda: life.app.cycle.counters.cycles > 0)
    return running


@pytest.mark.real_time
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
async def test_a_signal_ends_the_daemon_in_order(number: signal.Signals, tmp_path: Path) -> None:
    running = await _begin(tmp_path / "robot.sock")
    os.kill(os.getpid(), number)
    await asyncio.wait_for(running, 5.0)
    assert not (tmp_path / "robot.sock").exists()


@pytest.mark.real_time
async def test_a_hang_up_that_is_ignored_stays_ignored(tmp_path: Path) -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    running = await _begin(tmp_path / "robot.sock")
    os.kill(os.getpid(), signal.SIGHUP)
    await asyncio.sleep(0.05)
    assert not running.done()
    os.kill(os.getpid(), signal.SIGTERM)
    await running


@pytest.fixture(autouse=True)
def _signals() -> Iterator[None]:
    """Those that a command has taken are given back."""
    numbers = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
    before = [signal.getsignal(number) for number in numbers]
    yield
    for number, handler in zip(numbers, before, strict=True):
        signal.signal(number, handler)


def test_a_signal_before_the_daemon_has_begun_is_an_orderly_end() -> None:
    script = "import signal, daemon.cli.run as run\nrun._bus = lambda *_, **__: signal.raise_signal(signal.SIGTERM)\n"
    command = [sys.executable, "-c", script + "run.run(profile='max2d', simulate=True)"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=20)
    assert (ended.returncode, ended.stderr) == (0, "canhelm: ended before it began\n")


async def test_the_end_says_of_which_drives_nothing_is_known() -> None:
    app = App(load("max2d").profile)
    await app.start()
    assert app.network is not None
    await Robot(app).until(lambda: app.service.state == "idle")
    app.network.power_off("rear_left")
    await asyncio.sleep(1.0)
    assert [drive.name for drive in await app.close()] == ["rear_left"]


async def test_the_end_of_a_healthy_robot_leaves_no_doubt() -> None:
    app = App(load("max2d").profile)
    await app.start()
    await asyncio.sleep(3.0)
    assert await app.close() == ()


async def test_a_daemon_that_cannot_record_says_only_that(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    app = App(load("max2d").profile, record=tmp_path / "none" / "logs")
    with pytest.raises(ConfigError, match="none/logs"):
        await app.start()
    await app.close()
    assert caplog.messages == []


@pytest.mark.real_time
def test_a_socket_that_a_daemon_has_already_is_told_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "robot.sock"
    command = [sys.executable, "-m", "daemon", *SIMULATED, "--socket", str(path), "--runs", str(tmp_path / "runs")]
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(os.fspath(path))
        listener.listen()
        ended = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert ended.returncode == 1
    assert [line.partition(" on ")[0] for line in ended.stderr.splitlines()] == ["canhelm: a daemon already answers"]


@pytest.mark.parametrize("option", ["--socket", "--gateway"])
def test_the_folder_of_a_socket_is_not_made_up(option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SIMULATED, option, str(tmp_path / "none" / "x.sock")]) == 7
    assert f"there is no folder {tmp_path / 'none'}" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--tcp", "4310"], "--tcp and --tokens need each other"),
        (["--tokens", "tokens"], "--tcp and --tokens need each other"),
        (["--tcp", "robot:http", "--tokens", "tokens"], "give PORT or HOST:PORT, with a port of 1 to 65535"),
        (["--tcp", "abc", "--tokens", "tokens"], "give PORT or HOST:PORT, with a port of 1 to 65535"),
        (["--tcp", "99999", "--tokens", "tokens"], "--tcp 99999: there is no such port"),
    ],
)
def test_a_network_access_that_leads_nowhere_is_wrong_usage(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*SIMULATED, *arguments]) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize("role", ["watch", "drive", "configure"])
def test_a_group_that_is_named_has_to_be_there(role: str, tmp_path: Path) -> None:
    named = replace(Groups(), **{role: "no-such-group"})
    with pytest.raises(UsageError, match=f"--{role}-group: there is no group 'no-such-group'") as caught:
        App(load("max2d").profile, socket=tmp_path / "x.sock", groups=astuple(named))
    assert "sudo groupadd --system no-such-group" in str(caught.value.remedy)


def test_tokens_that_others_may_read_keep_a_daemon_from_beginning(tmp_path: Path) -> None:
    tokens = tmp_path / "tokens"
    tokens.write_text(f"drive {'d' * 32}")
    tokens.chmod(0o644)
    with pytest.raises(ConfigError, match="others than its owner may use"):
        App(load("max2d").profile, socket=tmp_path / "x.sock", tcp=TcpAccess("127.0.0.1", 0, tokens))


@pytest.mark.parametrize(("address", "host"), [("4310", "127.0.0.1"), ("10.0.0.7:4310", "10.0.0.7")])
def test_a_port_alone_is_one_of_the_loopback_interface(address: str, host: str, tmp_path: Path) -> None:
    access = tcp_access(address, tmp_path)
    assert access is not None
    assert (access.host, access.port) == (host, 4310)


def _network_listeners() -> list[str]:
    """Addresses at which this process takes something from a network."""
    found = []
    for descriptor in os.listdir("/proc/self/fd"):
        try:
            each = socket.socket(fileno=int(descriptor))
        except OSError:
            continue  # it is no socket
        if each.family in (socket.AF_INET, socket.AF_INET6):
            found.append(each.getsockname()[0])
        each.detach()
    return found


@pytest.mark.real_time
@pytest.mark.parametrize(("port", "addresses"), [(None, []), (0, ["127.0.0.1"])])
async def test_nothing_listens_on_a_network_unless_it_is_told_to(
    tmp_path: Path, port: int | None, addresses: list[str]
) -> None:
    gateway = GatewayAccess(tmp_path / "x.309.sock", tcp_port=port)
    app = App(load("max2d").profile, socket=tmp_path / "x.sock", gateway=gateway, powered=False)
    before = _network_listeners()
    await app.start()
    try:
        assert sorted(_network_listeners()) == sorted(before + addresses)
    finally:
        await app.close()


def test_a_text_log_is_no_mcap_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SIMULATED, "--record", str(tmp_path / "bus.log"), "--record-format", "mcap"]) == 2
    assert "a file that ends in .mcap" in capsys.readouterr().err


def test_an_mcap_file_is_no_text_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SIMULATED, "--record", str(tmp_path / "bus.mcap"), "--record-format", "candump"]) == 2
    assert "a file that ends in .log" in capsys.readouterr().err


def test_an_empty_record_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SIMULATED, "--record", ""]) == 2
    assert "--record is empty" in capsys.readouterr().err


def test_a_recording_without_any_room_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SIMULATED, "--record", "logs", "--record-mb", "0"]) == 2
    assert "--record-mb is below 1" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("run --simulate", "which robot?"),
        ("run --bus socketcan:can0 --bit-rate 7", "7 bit/s is no bit rate of an EPOS"),
        ("run --simulate --profile max2d --bit-rate 500000", "--bit-rate is for a bus without a profile"),
        ("run --bus socketcan:can0 --profile max2d --miswire max2d", "socketcan:can0 is real"),
    ],
)
def test_options_that_make_no_sense_together_are_refused(
    arguments: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments.split()) == 2
    assert words in capsys.readouterr().err


def test_real_drives_cannot_be_asked_to_have_no_power(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "--bus", "socketcan:can0", "--profile", "max2d", "--unpowered"]) == 2
    assert "socketcan:can0 is real" in capsys.readouterr().err
