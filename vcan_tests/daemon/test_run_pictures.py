"""What a run shows of a robot that is not as its profile says, and the commands that look at runs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from canhelm.errors import ConfigError
from daemon.cli.main import main
from daemon.runs.pictures import panels
from daemon.runs.signs import currents_at_limit, mean_currents_a, read_signs, side_by_side
from daemon.runs.store import FACTS, PROFILE, TERMS, Run, RunStore, read_runs, read_yaml
from daemon.runs.table import Table, read_table
from daemon.runtime.clock import run_virtual
from profiles.loader import load
from profiles.schema import Profile
from vcan_tests.robot import running_robot

Parallel = {"angle_deg": 0.0, "speed_m_s": 0.5, "duration_s": 3.0}


def wrong_wheel(folder: Path, radius_m: float) -> Profile:
    """A MAX2D whose second wheel is of another size."""
    file = folder / "wrong.yaml"
    values = {"schema_version": 1, "extends": "max2d", "drives": {"rear_left": {"wheel_radius_m": radius_m}}}
    file.write_text(yaml.safe_dump(values))
    return load(str(file)).profile


def driven(folder: Path, built: Profile | None = None, backward: bool = False) -> Run:
    """The run of a straight drive by the shipped profile."""

    async def drive() -> None:
        async with running_robot(runs=RunStore(folder / "runs"), built=built) as robot:
            await robot.call("drive.parallel", **{**Parallel, "speed_m_s": -0.5 if backward else 0.5})

    run_virtual(drive())
    return read_runs([folder / "runs"])[-1]


def signs_of(run: Run) -> list[str]:
    return read_signs(read_table(run), read_yaml(run.folder / PROFILE))


def limits_of(run: Run) -> dict[str, list[float]]:
    return currents_at_limit(read_table(run), read_yaml(run.folder / PROFILE))


def test_a_wheel_that_is_too_large_stands_out_by_pushing(tmp_path: Path) -> None:
    (sign,) = signs_of(driven(tmp_path, wrong_wheel(tmp_path, 0.105)))
    assert sign.startswith("rear_left pushes: +")
    assert "larger than the profile's wheel_radius_m" in sign


def test_a_wheel_that_is_too_small_stands_out_by_being_dragged(tmp_path: Path) -> None:
    (sign,) = signs_of(driven(tmp_path, wrong_wheel(tmp_path, 0.095)))
    assert sign.startswith("rear_left is dragged: -")
    assert "smaller than the profile's wheel_radius_m" in sign


def test_it_stands_out_backwards_too(tmp_path: Path) -> None:
    (sign,) = signs_of(driven(tmp_path, wrong_wheel(tmp_path, 0.105), backward=True))
    assert sign.startswith("rear_left pushes: +")


def test_nothing_stands_out_of_a_healthy_run(tmp_path: Path) -> None:
    run = driven(tmp_path)
    assert len(side_by_side(read_table(run))) > 100
    assert signs_of(run) == []
    assert limits_of(run) == {}


def test_the_others_currents_are_told_from_the_least_to_the_greatest(tmp_path: Path) -> None:
    run = driven(tmp_path, wrong_wheel(tmp_path, 0.105))
    table = read_table(run)
    means = mean_currents_a(table, side_by_side(table))
    others = [means[name] for name in ("rear_right", "front_left", "front_right")]
    assert f"the other wheels {min(others):+.2f} to {max(others):+.2f} A at the same speed" in signs_of(run)[0]


def test_a_current_that_a_drive_holds_at_its_limit_is_a_limit_in_force(tmp_path: Path) -> None:
    times = limits_of(driven(tmp_path, wrong_wheel(tmp_path, 0.105)))
    assert list(times) == ["rear_left at 2.64 A", "rear_left at 5 A"]
    assert times["rear_left at 5 A"][-1] < times["rear_left at 2.64 A"][0]


@pytest.mark.parametrize(("rows", "held"), [(5, False), (20, True)])
def test_a_current_that_passes_by_a_limit_is_not_held_there(rows: int, held: bool) -> None:
    column = [0.0] * 10 + [-1.995] * rows + [0.0] * 10
    table = Table({"time_s": [row * 0.01 for row in range(len(column))], "left.current_a": column}, {})
    times = currents_at_limit(table, {"drives": {"left": {"continuous_current_a": 2.0}}})
    assert times == ({"left at 2 A": pytest.approx([row * 0.01 for row in range(10, 10 + rows)])} if held else {})


def test_a_curve_says_nothing_about_radii(tmp_path: Path) -> None:
    async def drive() -> None:
        async with running_robot(runs=RunStore(tmp_path)) as robot:
            await robot.call("drive.turn", rear_deg=-15.0, front_deg=15.0, speed_m_s=0.4, duration_s=3.0)

    run_virtual(drive())
    assert side_by_side(read_table(read_runs([tmp_path])[0])) == []


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one run of a robot with a wrong wheel."""
    folder = tmp_path_factory.mktemp("robot")
    return driven(folder, wrong_wheel(folder, 0.105)).folder.parent


def test_a_picture_has_no_empty_panels(tmp_path: Path) -> None:
    async def drive() -> None:
        async with running_robot(load("nxt").profile, runs=RunStore(tmp_path)) as robot:
            await robot.call("nxt.line", distance_m=0.2)

    run_virtual(drive())
    run = read_runs([tmp_path])[-1]
    titles = [panel.keywords.get("title") for panel in panels(run, read_table(run), read_yaml(run.folder / PROFILE))]
    assert "steering headings, by their encoders" not in titles
    assert "motor currents (positive: pushes forward)" not in titles
    assert len(titles) == 4


def test_plot_last_draws_the_run_and_says_what_stands_out(
    runs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "picture.png"
    assert main(["plot", "last", "--runs", str(runs), "--out", str(picture)]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert "rear_left pushes" in json.loads(capsys.readouterr().out)["stands_out"][0]


def test_runs_lists_each_run_on_a_line(runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["runs", "--runs", str(runs), "--json"]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    listed = json.loads(line)
    assert (listed["run"], listed["motion"], listed["ended"]) == (1, "drive.parallel", "done")


def test_runs_show_tells_where_the_files_are(runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["runs", "show", "1", "--runs", str(runs), "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert TERMS in shown["files"]
    assert shown["asked"] == Parallel


@pytest.mark.parametrize(
    ("ended", "told"),
    [("DeviceFault", "device fault"), ("cut off", "cut off"), (None, "not ended: it runs, or its daemon was killed")],
)
def test_people_are_told_in_words_how_a_run_ended(
    ended: str | None, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "0001").mkdir()
    (tmp_path / "0001" / FACTS).write_text(yaml.safe_dump({"robot": "max2d", **({"ended": ended} if ended else {})}))
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert main(["runs", "show", "--runs", str(tmp_path)]) == 0
    assert f"ended: {told}" in capsys.readouterr().out.splitlines()


def test_programs_are_told_of_a_run_that_has_not_ended(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "0001").mkdir()
    assert main(["runs", "show", "--runs", str(tmp_path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["ended"] is None


def test_runs_of_another_robot_are_left_out(runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["runs", "--runs", str(runs), "--robot", "turtle", "--json"]) == 0
    assert capsys.readouterr().out == ""


def test_no_runs_are_told_with_the_folder_that_was_looked_into(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["runs", "--runs", str(tmp_path), "--robot", "turtle"]) == 0
    assert f"no runs of turtle in {tmp_path}:" in capsys.readouterr().err


def test_a_deleted_run_is_gone(tmp_path: Path) -> None:
    for name in ("0001", "0002"):
        (tmp_path / name).mkdir()
    assert main(["runs", "delete", "1", "--runs", str(tmp_path)]) == 0
    assert [run.number for run in read_runs([tmp_path])] == [2]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["plot", "99"], 2, "there is no run 99"),
        (["plot", "-x"], 2, "-x"),
        (["plot", "first"], 2, "'first' is no run"),
        (["plot", "last", "--out", "run.exe"], 2, "exe"),
        (["plot", "last", "--out", "/nonexistent/run.png"], 2, "cannot write"),
        (["runs", "delete"], 2, "which runs"),
        (["runs", "show", "1.5"], 2, "is no run"),
    ],
)
def test_nonsense_is_refused_with_words(
    runs: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], code: int, words: str
) -> None:
    assert main([*arguments, "--runs", str(runs)]) == code
    assert words in capsys.readouterr().err


def test_a_folder_without_runs_is_wrong_usage(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", "--runs", str(tmp_path)]) == 2
    assert "there are no runs" in capsys.readouterr().err


def test_a_run_without_rows_is_said_to_be_damaged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "0001").mkdir()
    assert main(["plot", "--runs", str(tmp_path)]) == 7
    assert "cycles.csv" in capsys.readouterr().err


@pytest.mark.parametrize("column", ["limits", "x_m", "rear_left.commanded_m_s"])
def test_a_run_without_a_column_that_every_run_has_is_damaged(tmp_path: Path, column: str) -> None:
    (tmp_path / "cycles.csv").write_text(
        "time_s,x_m,y_m,yaw_deg,rear_left.commanded_m_s,rear_left.speed_m_s,limits\n0,0,0,0,0,0,\n".replace(column, "y")
    )
    with pytest.raises(ConfigError, match=f"has no column {column}"):
        read_table(Run(1, tmp_path, {}))


@pytest.mark.parametrize(
    "drives", ["", "drives: []", "drives: {rear_left: 5}", "drives: {rear_left: {continuous_current_a: x}}"]
)
def test_current_limits_that_a_profile_does_not_tell_are_none(tmp_path: Path, drives: str) -> None:
    run = driven(tmp_path)
    (run.folder / PROFILE).write_text(drives)
    assert (signs_of(run), limits_of(run)) == ([], {})


def test_terms_that_are_none_are_passed_over(tmp_path: Path) -> None:
    run = driven(tmp_path)
    (run.folder / TERMS).write_text('7\n{"time_s": 1}\n{"time_s": 1, "terms": {"guidance": 3}}\n{"time_s": ')
    *_, active = panels(run, read_table(run), read_yaml(run.folder / PROFILE))
    assert not any("slip" in name for name in active.keywords["times"])


def test_facts_that_are_nested_without_end_are_none(tmp_path: Path) -> None:
    (tmp_path / "run.yaml").write_text("[" * 5000)
    assert read_yaml(tmp_path / "run.yaml") == {}


def test_a_last_row_that_was_cut_short_is_left_out(tmp_path: Path) -> None:
    run = driven(tmp_path)
    rows = len(read_table(run).time_s)
    with (run.folder / "cycles.csv").open("a") as file:
        file.write("9.99,1.0")
    assert len(read_table(run).time_s) == rows
