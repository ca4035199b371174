"""A long life made short, and what its judge says of lives that are not flat."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from canhelm.aio import Client
from profiles.loader import load
from vcan_tests.long_life.figures import LOGS, RUNS, Sample, complaints, draw, growth_per_h, table
from vcan_tests.long_life.life import RECORD_BYTES, RUNS_BYTES, live, make_app
from vcan_tests.long_life.loop import VirtualSocketLoop
from vcan_tests.long_life.stage import Stage

MAX2D = load("max2d").profile
FIRST = Sample(
    time_s=3.0,
    memory_kib=90_000,
    objects=100_000,
    blocks=400_000,
    tasks=7,
    descriptors=12,
    log_bytes=0,
    run_bytes=0,
    faults=0,
)


def lived(hours: float, memory_kib_h: float = 0.0, objects_h: float = 0.0, blocks_h: float = 0.0) -> list[Sample]:
    """A sample a minute."""
    return [
        replace(
            FIRST,
            time_s=FIRST.time_s + 60.0 * minute,
            memory_kib=FIRST.memory_kib + round(memory_kib_h * minute / 60.0) + 100 * (minute % 7),
            objects=FIRST.objects + round(objects_h * minute / 60.0) + 20 * (minute % 5),
            blocks=FIRST.blocks + round(blocks_h * minute / 60.0) + 50 * (minute % 3),
        )
        for minute in range(round(60.0 * hours) + 1)
    ]


def judged(samples: Sequence[Sample]) -> list[str]:
    return complaints(samples, RECORD_BYTES, RUNS_BYTES)


def test_a_flat_life_is_not_complained_of() -> None:
    assert judged(lived(12.0)) == []


@pytest.mark.parametrize(
    ("growth_h", "told"),
    [((400.0, 0.0, 0.0), "memory_kib"), ((0.0, 800.0, 0.0), "objects"), ((0.0, 0.0, 3000.0), "blocks")],
)
def test_memory_that_grows_is_complained_of(growth_h: tuple[float, float, float], told: str) -> None:
    (complaint,) = judged(lived(3.0, *growth_h))
    assert complaint.startswith(f"{told} grows by")


def test_what_memory_takes_in_the_first_half_hour_is_not_growth() -> None:
    samples = [one if one.time_s > 1800.0 else replace(one, memory_kib=50_000) for one in lived(3.0)]
    assert judged(samples) == []


def test_an_hour_is_too_short_to_tell_growth() -> None:
    assert growth_per_h(lived(1.0, 9e9), "memory_kib") is None


@pytest.mark.parametrize("change", [{"tasks": 8}, {"tasks": 6}, {"descriptors": 13}])
def test_a_task_or_a_descriptor_that_is_left_is_complained_of(change: dict[str, int]) -> None:
    samples = lived(0.1)
    samples[3] = replace(samples[3], **change)
    (complaint,) = judged(samples)
    assert "at 183 s" in complaint


@pytest.mark.parametrize("change", [{"log_bytes": RECORD_BYTES + 1}, {"run_bytes": RUNS_BYTES + 1}])
def test_logs_beyond_their_limits_are_complained_of(change: dict[str, int]) -> None:
    assert len(judged([*lived(0.1), replace(FIRST, **change)])) == 1


def test_a_table_has_a_row_an_hour_and_the_ends() -> None:
    assert [row["hours"] for row in table(lived(2.5))] == ["0.00", "1.00", "2.00", "2.50"]


def test_a_picture_is_drawn(tmp_path: Path) -> None:
    draw(lived(2.0), tmp_path / "life.png")
    assert (tmp_path / "life.png").stat().st_size > 10_000


def test_a_life_of_a_minute_is_good(tmp_path: Path) -> None:
    life = live(MAX2D, 1.0 / 60.0, 2, tmp_path, lambda _: None)
    assert life.defects == []
    assert life.samples[-1].time_s >= 60.0
    assert life.counts["fault"] >= 2
    assert (tmp_path / LOGS).is_dir()
    assert (tmp_path / RUNS).is_dir()


def test_the_same_seed_lives_the_same_life(tmp_path: Path) -> None:
    first, second = (live(MAX2D, 0.003, 2, _made(tmp_path / name), lambda _: None) for name in ("first", "second"))
    assert first.counts == second.counts
    assert [one.time_s for one in first.samples] == [one.time_s for one in second.samples]


def test_a_robot_that_does_not_get_going_again_is_a_defect_and_is_switched_off_and_on(tmp_path: Path) -> None:
    async def lose_power() -> Stage:
        app = make_app(MAX2D, tmp_path, 1)
        await app.start()
        stage = Stage(app, Random(1))
        await stage.recover("the boot")
        async with Client(stage.socket) as person:
            await person.call("simulation.power", node="front_left", on=False)
        await asyncio.sleep(1.0)
        await stage.recover("a loose plug")
        assert app.service.state == "idle"
        await app.close()
        return stage

    with asyncio.Runner(loop_factory=VirtualSocketLoop) as runner:
        stage = runner.run(lose_power())
    (defect,) = stage.defects
    assert "after a loose plug: it stays waiting: waiting for node 3 (front_left)" in defect


def _made(folder: Path) -> Path:
    folder.mkdir()
    return folder
