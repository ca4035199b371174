"""Help and completions."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from canhelm import protocol
from vcan_tests.daemon.cli.shell import run
from vcan_tests.daemon.cli.test_commands import SENT

NOUNS = ("motor", "brake", "drive", "nmt", "sdo", "sim")
WITH_EXAMPLES = {" ".join(line.split()[: 1 + (line.split()[0] in NOUNS)]) for line, _, _ in SENT}
WITH_EXAMPLES |= {"status", "monitor", "doctor", "version", "completion", "explain", "run", "make-safe", "demo"}


@pytest.mark.parametrize("command", sorted(WITH_EXAMPLES))
def test_every_command_helps_with_an_example(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(f"{command} --help") == 0
    assert f"Example: canhelm {command}" in capsys.readouterr().out


def test_day_to_day_verbs_come_first_in_the_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("-h") == 0
    text = capsys.readouterr().out
    assert "Stop everything now" in text
    assert text.index("stop") < text.index("status") < text.index("steer") < text.index("nmt") < text.index("demo")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_knows_the_verbs(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(f"completion {shell}") == 0
    assert "quick-stop" in capsys.readouterr().out


def test_no_option_leaves_another_without_its_values(capsys: pytest.CaptureFixture[str]) -> None:
    run("completion bash")
    assert "--empty-" not in capsys.readouterr().out


def test_an_installed_completion_says_which_startup_file_it_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    assert run("completion bash --install") == 0
    assert "~/.bashrc loads it" in capsys.readouterr().err
    assert "canhelm" in (tmp_path / ".bashrc").read_text()


def test_a_completion_that_cannot_be_installed_tells_the_way_by_hand(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("HOME", "/proc/nowhere")
    assert run("completion bash --install") == 7
    assert "canhelm completion bash > FILE" in capsys.readouterr().err


def test_the_help_of_steer_promises_only_what_steers(capsys: pytest.CaptureFixture[str]) -> None:
    run("steer --help")
    assert "rear or all" not in capsys.readouterr().out


def test_version_names_the_api(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("version") == 0
    assert json.loads(capsys.readouterr().out)["api_version"] == protocol.API_VERSION
