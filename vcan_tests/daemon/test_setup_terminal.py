"""``canhelm setup`` at a terminal, beside a simulated robot that is wired wrong."""

from __future__ import annotations

import asyncio
import json
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from profiles.loader import load
from vcan_tests.daemon.test_calibration import Person
from vcan_tests.daemon.test_processes import PATIENT_PROFILE, Bench
from vcan_tests.daemon.workshop_person import WorkshopPerson

ENDS = (" [y/n] ", "Enter and watch ", "NAME forward` ", "then press Enter ", "100] ", "200] ")
BUILT = PATIENT_PROFILE + "drives: {rear_left: {direction: -1}}\n"


@pytest.fixture
def miswired(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    """A daemon on a simulated robot whose rear left wheel is reversed, on blocks."""
    built = tmp_path / "built.yaml"
    built.write_text(BUILT)
    monkeypatch.setenv("CANHELM_MISWIRE", str(built))
    bench = Bench(tmp_path, profile_text=f"{PATIENT_PROFILE}setup: needed\n")
    bench.client.call("simulation.lift", lifted=True)
    yield bench
    bench.kill()


def eyes_on(bench: Bench) -> WorkshopPerson:
    """Somebody who sees and turns what the daemon simulates."""

    async def call(method: str, **params: Any) -> dict[str, Any]:
        return bench.client.call(method, **params)

    return WorkshopPerson(call)


@pytest.mark.real_time
def test_a_reversed_wheel_is_found_and_written(miswired: Bench, tmp_path: Path) -> None:
    person, eyes = Person(miswired, ["setup", "rear_left", "--json"]), eyes_on(miswired)
    asked = person.reads_until(*ENDS)
    while "write it?" not in asked:
        person.types(asyncio.run(eyes.ask(asked.splitlines()[-1].strip())))
        asked = person.reads_until(*ENDS)
    assert "drives.rear_left.direction: 1 -> -1" in asked
    person.types("y")
    told = json.loads(person.process.communicate(timeout=60)[0])
    assert person.process.returncode == 0
    assert told["wrong"] == ["reversed: rear_left rolls backward when it shall roll forward"]
    assert load(tmp_path / "max2d.yaml").profile.drives["rear_left"].direction == -1


def begun(bench: Bench) -> Person:
    """A setup that is about to turn its first wheel, with its limits lowered."""
    person = Person(bench, ["setup", "rear_left"])
    for _ in range(2):
        person.reads_until(" [y/n] ")
        person.types("y")
    person.reads_until("Enter and watch ")
    assert limit_ma(bench) == 500
    return person


def jogged(bench: Bench) -> Person:
    """A setup whose first wheel turns."""
    person = begun(bench)
    person.types("")
    bench.wait_for(lambda status: status["state"] == "active")
    return person


@pytest.mark.real_time
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_leaves_everything_as_it_was(number: signal.Signals, miswired: Bench, tmp_path: Path) -> None:
    person = jogged(miswired)
    os.kill(person.process.pid, number)
    person.reads_until("broken off: the drives are as they were")
    person.process.communicate(timeout=30)
    assert person.process.returncode == 130
    assert limit_ma(miswired) == 5000
    assert miswired.status()["state"] == "idle"
    assert not (tmp_path / "max2d.calibration.yaml").exists()


def limit_ma(bench: Bench) -> int:
    """The output current limit of the rear left drive."""
    return int(bench.client.call("sdo.read", node="rear_left", object="output_current_limit")["value"])


@pytest.mark.real_time
def test_the_daemon_puts_the_limits_back_when_the_setup_is_killed(miswired: Bench) -> None:
    person = jogged(miswired)
    person.process.kill()
    person.process.communicate(timeout=30)
    miswired.wait_for(lambda status: any("the setup was broken off" in event["message"] for event in status["events"]))
    assert (limit_ma(miswired), miswired.status()["state"]) == (5000, "idle")
    assert miswired.canhelm("motor", "enable", "rear_left").returncode == 0


@pytest.mark.real_time
def test_a_daemon_that_is_killed_meanwhile_is_told_with_what_to_do(miswired: Bench) -> None:
    person = jogged(miswired)
    miswired.process.kill()
    person.reads_until("current limits may still be lowered")
    person.process.communicate(timeout=30)
    assert person.process.returncode == 3


@pytest.mark.real_time
def test_meanwhile_others_may_only_look_and_stop(miswired: Bench) -> None:
    person = begun(miswired)
    for command in ("motor velocity front_left 100 --duration 1", "motor enable front_left", "brake release front"):
        refused = miswired.canhelm(*command.split())
        assert (command, refused.returncode) == (command, 6)
        assert "a setup is under way" in refused.stderr
    assert miswired.canhelm("sdo", "write", "front_left", "output_current_limit", "600").returncode == 6
    assert miswired.canhelm("status").returncode == 0
    assert miswired.canhelm("stop").returncode == 0
    second = Person(miswired, ["setup", "front_left"])
    second.reads_until(" [y/n] ")
    second.types("y")
    second.reads_until("a setup is under way")
    second.process.communicate(timeout=30)
    assert second.process.returncode == 6
    os.kill(person.process.pid, signal.SIGINT)
    person.process.communicate(timeout=30)
    assert limit_ma(miswired) == 5000


@pytest.mark.real_time
@pytest.mark.parametrize(
    ("what", "code", "told"), [("rear_left", 2, "nobody is there"), ("nosuch", 4, "no wheel nosuch")]
)
def test_without_a_terminal_nobody_is_asked_but_names_are_checked(
    what: str, code: int, told: str, miswired: Bench
) -> None:
    refused = miswired.canhelm("setup", what)
    assert (refused.returncode, told in refused.stderr) == (code, True)
