"""The fault campaign: that its judge complains where it must, and that nothing is lost or tried twice."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from canhelm import __version__
from canhelm.errors import ConfigError, UsageError
from daemon.campaigns.faults import course, plan
from daemon.campaigns.faults.limits import Limits, limits_of
from daemon.campaigns.faults.outcome import MANOEUVRES, Outcome
from daemon.campaigns.faults.plan import injection_of, named, planned
from daemon.campaigns.faults.points import Point, note_points, try_all, try_one
from daemon.campaigns.faults.results import LINES, SUMMARY, opened, table, write_summary
from daemon.campaigns.faults.strikes import OTHER_ROBOTS, STRIKES, Injection
from daemon.campaigns.faults.workers import outcomes_of
from daemon.cli.campaign_options import worked_by
from daemon.cli.main import main
from daemon.runtime import watch
from daemon.runtime.stopping import Stopping
from drivers.contract import Drive
from drivers.simulated.brake import SimulatedBrake
from profiles.faults import KIND_NAMES
from profiles.schema import Profile

DRIVING, STOPPING = 3600, 4100
"""Frames in the middle of the stop manoeuvre, and of what follows its stop."""
TINY = [
    *(Injection(name, DRIVING) for name in ("lose", "duplicate", "corrupt")),
    *(Injection(name, 240) for name in ("silence", "unplugged", "encoder_jump", "estop", "client_gone")),
]


def tried(injections: list[Injection]) -> dict[Injection, Outcome]:
    found: list[Outcome] = []
    try_all(injections, 1, found.append)
    return {Injection(outcome.strike, outcome.index): outcome for outcome in found}


def limited(monkeypatch: pytest.MonkeyPatch, **limits: float) -> None:
    """Judge by other limits."""

    def lowered(profile: Profile) -> Limits:
        return replace(limits_of(profile), **limits)  # type: ignore[arg-type]

    monkeypatch.setattr(course, "limits_of", lowered)


def test_a_course_that_nothing_strikes_violates_nothing_and_has_points_in_every_manoeuvre() -> None:
    points, undisturbed = note_points(1)
    assert undisturbed.judge.violations == {}
    assert {point.manoeuvre for point in points} == set(MANOEUVRES)
    assert {point.manoeuvre for point in points if point.can_id is None} == set(MANOEUVRES)


def test_a_tiny_campaign_violates_nothing_and_each_robot_drives_again() -> None:
    outcomes = tried(TINY)
    assert set(outcomes) == set(TINY)
    assert {key: outcome.violations for key, outcome in outcomes.items() if outcome.violations} == {}
    assert {outcome.recovered for outcome in outcomes.values()} == {"nothing", "reset"}
    silence = outcomes[Injection("silence", 240)]
    assert silence.stopped
    assert silence.rest_s is not None
    assert 0.0 < silence.rest_s < 0.4


def test_an_injection_that_is_played_again_comes_out_as_in_the_campaign() -> None:
    injection = Injection("silence", 240)
    assert try_one(injection, 1).outcome == tried([injection])[injection]


@pytest.mark.parametrize(
    ("limits", "invariant"),
    [
        ({"steering_m_s": 0.0, "wrong_target_m_s": 0.0}, "speed"),
        ({"heading_rad": 0.01}, "heading"),
        ({"quick_stop_m_s2": 1e9, "settling_m": 1e-4}, "rest"),
    ],
)
def test_a_limit_that_is_not_kept_is_told(
    monkeypatch: pytest.MonkeyPatch, limits: dict[str, float], invariant: str
) -> None:
    limited(monkeypatch, **limits)
    _, undisturbed = note_points(1)
    assert invariant in undisturbed.judge.violations


def test_a_drive_that_keeps_its_power_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    async def forget(self: Stopping, drive: Drive) -> None:
        """Leave it on."""

    monkeypatch.setattr(Stopping, "power_off", forget)
    outcome = try_one(Injection("estop", 240), 1).outcome
    assert outcome is not None
    assert "torque" in outcome.violations


def test_silence_that_nobody_notices_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watch, "SILENT_CYCLES", 20)
    outcome = try_one(Injection("silence", 240), 1).outcome
    assert outcome is not None
    assert "notice" in outcome.violations


def test_a_brake_that_does_not_engage_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    moved = SimulatedBrake._moved
    monkeypatch.setattr(SimulatedBrake, "_moved", lambda self, engaged: moved(self, engaged) if not engaged else None)
    outcome = try_one(Injection("estop", 240), 1).outcome
    assert outcome is not None
    assert "brake" in outcome.violations


def test_a_robot_that_does_not_recover_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    async def refuse(self: Stopping) -> None:
        raise UsageError("no")

    monkeypatch.setattr(Stopping, "reset", refuse)
    outcome = try_one(Injection("estop", 240), 1).outcome
    assert outcome is not None
    assert "recovery" in outcome.violations
    assert outcome.recovered == ""


def test_a_child_that_comes_to_no_end_is_a_violation(monkeypatch: pytest.MonkeyPatch) -> None:
    async def fail(self: course.Course, outcome: Outcome) -> None:
        raise RuntimeError

    monkeypatch.setattr(course.Course, "_recover", fail)
    injection = Injection("lose", STOPPING)
    assert list(tried([injection])[injection].violations) == ["end"]


def test_every_kind_of_fault_strikes_or_is_said_to_need_another_robot() -> None:
    assert {strike.kind for strike in STRIKES.values()} - {""} == set(KIND_NAMES) - set(OTHER_ROBOTS)


def test_the_short_manoeuvre_is_struck_at_every_point_and_the_others_at_samples() -> None:
    points = [Point(index, MANOEUVRES[index // 10], 0x183, 8) for index in range(40)]
    found = planned(points, 3, 1, ["lose"])
    counts = [sum(10 * n <= injection.index < 10 * n + 10 for injection in found) for n in range(4)]
    assert counts == [3, 3, 3, 10]
    assert planned(points, 3, 1, ["pdo_long", "silence"]) == []


def test_a_killed_campaign_goes_on_where_it_was(tmp_path: Path) -> None:
    outcomes = [Outcome("lose", index, "stop", at_s=0.1 * index, recovered="nothing") for index in (1, 2, 3)]
    with opened(tmp_path, 1) as results:
        for outcome in outcomes:
            results.keep(outcome)
    file = tmp_path / LINES
    file.write_bytes(file.read_bytes()[:-7])
    with opened(tmp_path, 1) as results:
        assert list(results.tried.values()) == outcomes[:2]
        results.keep(outcomes[2])
    with opened(tmp_path, 1) as results:
        assert list(results.tried.values()) == outcomes


@pytest.mark.parametrize("change", [('"seed":1', '"seed":2'), ('"strike"', '"stroke"'), ("lose", "lo\nse")])
def test_results_of_something_else_are_refused(tmp_path: Path, change: tuple[str, str]) -> None:
    with opened(tmp_path, 1) as results:
        results.keep(Outcome("lose", 1, "stop"))
    file = tmp_path / LINES
    file.write_text(file.read_text(encoding="utf-8").replace(*change), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"results\.jsonl:\d"), opened(tmp_path, 1):
        pass


def test_the_table_has_injections_violations_worst_time_and_actions(tmp_path: Path) -> None:
    outcomes = [
        Outcome("lose", 1, "stop", stopped=True, rest_s=0.2, recovered="reset"),
        Outcome("lose", 2, "stop", stopped=True, rest_s=0.3, violations={"rest": "it rolls"}),
    ]
    (row,) = table(outcomes)
    assert (row["injections"], row["violations"], row["worst_rest_s"]) == (2, 1, 0.3)
    assert row["recovered"] == {"reset": 1, "not": 1}
    summary = json.loads(write_summary(tmp_path, 1, outcomes).read_text(encoding="utf-8"))
    assert (summary["injections"], summary["violations"]) == (2, 1)
    assert summary["failed"][0]["violations"] == {"rest": "it rolls"}


@pytest.mark.parametrize("text", ["lose", "lose:", "lose:0", "lose:x", "loose:3"])
def test_what_names_no_injection_is_refused(text: str) -> None:
    with pytest.raises(UsageError):
        injection_of(text)


def test_a_name_that_is_no_fault_is_refused() -> None:
    with pytest.raises(UsageError, match="is no fault"):
        named(["loose"])


@pytest.mark.real_time
def test_two_workers_find_what_one_process_finds() -> None:
    found = {Injection(outcome.strike, outcome.index): outcome for outcome in outcomes_of(TINY[:4], 1, 2)}
    assert found == tried(TINY[:4])


@pytest.mark.real_time
def test_the_command_tries_tells_and_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(plan, "SHORT", "")
    command = ["campaign", "faults", "silence", "--samples", "1", "--workers", "1", "--out", str(tmp_path), "--json"]
    assert main(command) == 0
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [row["injections"] for row in rows] == [1, 1, 1, 1]
    assert {path.name for path in tmp_path.iterdir()} == {LINES, SUMMARY, "faults.png"}
    assert main(command) == 0
    assert "4 of 4 injections are there already" in capsys.readouterr().err


def test_the_command_plays_one_injection_again(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["campaign", "faults", "--only", "silence:240", "--json"]) == 0
    told = capsys.readouterr()
    assert json.loads(told.out)["part"] in told.err
    assert "is silent" in told.err


def test_results_of_another_seed_are_refused_in_words(tmp_path: Path) -> None:
    with opened(tmp_path, 1):
        pass
    told = rf"is of seed 1 and canhelm {__version__}, not of seed 2 and canhelm"
    with pytest.raises(ConfigError, match=told), opened(tmp_path, 2):
        pass


@pytest.mark.parametrize(("count", "told"), [(1, "1 worker"), (2, "2 workers")])
def test_who_works_is_told_in_words(count: int, told: str) -> None:
    assert worked_by(count) == told


@pytest.mark.parametrize("option", [("--only", "lose:999999"), ("--samples", "0")])
def test_what_strikes_nothing_is_refused(option: tuple[str, str]) -> None:
    assert main(["campaign", "faults", *option]) == 2


def test_a_violation_is_told_and_makes_the_command_fail(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    limited(monkeypatch, heading_rad=0.01)
    assert main(["campaign", "faults", "--only", "silence:240", "--json"]) == 1
    assert "heading" in json.loads(capsys.readouterr().out)["violations"]
