"""A long life made short, and what its judge says of lives that are not flat."""

from __future__ import annotations

import asyncio
import gc
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from canhelm.aio import Client
from profiles.loader import load
from vcan_tests.long_life.chapters import opening
from vcan_tests.long_life.figures import complaints, draw, growth_per_h, table
from vcan_tests.long_life.life import RECORD_BYTES, RUNS_BYTES, Life, live, make_app
from vcan_tests.long_life.loop import VirtualSocketLoop, run_with_sockets
from vcan_tests.long_life.samples import LOGS, RUNS, Sample, read_samples, take_sample, write_sample
from vcan_tests.long_life.stage import Stage

MAX2D = load("max2d").profile
FIRST = Sample(
    time_s=3.0,
    memory_kib=90_000,
    heap_kib=20_000,
    objects=100_000,
    blocks=400_000,
    tasks=7,
    descriptors=12,
    log_bytes=0,
    run_bytes=0,
    faults=0,
    kinds=20,
)
FULL_AT = 30
"""Minutes after which the logs of a life that is made up let old files go."""


def lived(hours: float, **growth_h: float) -> list[Sample]:
    """A sample a minute, with what one visit or another has not given back yet."""
    visits = {"memory_kib": 100, "heap_kib": 30, "objects": 20, "blocks": 50}
    return [
        replace(
            FIRST,
            time_s=FIRST.time_s + 60.0 * minute,
            log_bytes=minute % FULL_AT,
            run_bytes=minute % FULL_AT,
            **{
                field: getattr(FIRST, field) + round(growth_h.get(field, 0.0) * minute / 60.0) + visit * (minute % 7)
                for field, visit in visits.items()
            },
        )
        for minute in range(round(60.0 * hours) + 1)
    ]


def judged(samples: Sequence[Sample]) -> list[str]:
    return complaints(samples, RECORD_BYTES, RUNS_BYTES)


def test_a_flat_life_is_not_complained_of() -> None:
    assert judged(lived(12.0)) == []


@pytest.mark.parametrize(
    ("field", "growth_h"), [("memory_kib", 500), ("heap_kib", 70), ("objects", 25), ("blocks", 110)]
)
def test_memory_that_grows_is_complained_of(field: str, growth_h: float) -> None:
    (complaint,) = judged(lived(12.0, **{field: growth_h}))
    assert complaint.startswith(f"{field} grows by")


@pytest.mark.parametrize("field", ["memory_kib", "heap_kib", "objects", "blocks"])
def test_what_is_taken_until_the_logs_are_full_is_not_growth(field: str) -> None:
    samples = lived(3.0)
    samples[:FULL_AT] = [replace(one, **{field: 0}) for one in samples[:FULL_AT]]
    assert judged(samples) == []


def test_what_is_taken_until_everything_has_happened_once_is_not_growth() -> None:
    samples = lived(4.0)
    samples[:100] = [replace(one, objects=0, kinds=19) for one in samples[:100]]
    assert judged(samples) == []


def test_what_comes_and_goes_is_not_growth() -> None:
    samples = [replace(one, objects=FIRST.objects + 5000 * (minute % 15 > 0)) for minute, one in enumerate(lived(6.0))]
    assert judged(samples) == []


def test_less_than_an_hour_of_full_logs_is_too_short_to_tell_growth() -> None:
    assert growth_per_h(lived(1.4, memory_kib=9e9), "memory_kib") is None


def test_fewer_looks_than_parts_are_too_few_to_tell_growth() -> None:
    assert growth_per_h(lived(12.0, memory_kib=9e9)[::100], "memory_kib") is None


def test_logs_that_are_never_full_leave_nothing_to_judge() -> None:
    samples = [replace(one, log_bytes=minute) for minute, one in enumerate(lived(3.0, memory_kib=9e9))]
    assert growth_per_h(samples, "memory_kib") is None


@pytest.mark.parametrize(
    ("leak", "told"),
    [
        pytest.param(list, set(), id="nothing"),
        pytest.param(
            lambda: [bytes(100) for _ in range(30_000)], {"memory_kib", "heap_kib", "blocks"}, id="100 bytes a cycle"
        ),
        pytest.param(lambda: [[] for _ in range(8)], {"objects"}, id="an object a fault"),
    ],
)
async def test_what_is_left_behind_is_complained_of_and_the_look_itself_leaves_nothing(
    tmp_path: Path, leak: Callable[[], list[object]], told: set[str]
) -> None:
    left: list[object] = []
    path = tmp_path / "samples.jsonl"
    gc.collect()
    gc.freeze()  # what all other tests have made needs no looking through
    try:
        for sixth in range(19):
            left.extend(leak())
            logs = {"log_bytes": -sixth, "run_bytes": -sixth}
            write_sample(path, replace(take_sample(tmp_path, {"fault": 8 * sixth}), **logs))
            await asyncio.sleep(600.0)
    finally:
        gc.unfreeze()
    assert {complaint.split()[0] for complaint in judged(read_samples(path))} == told


def test_a_crowd_leaves_nothing_behind(tmp_path: Path) -> None:
    async def objects() -> list[int]:
        app = make_app(MAX2D, tmp_path, 1)
        await app.start()
        stage = Stage(app, Random(1))
        await stage.recover("the boot")
        found = []
        for _ in range(2):
            await opening(stage)
            await asyncio.sleep(1.0)
            found.append(take_sample(tmp_path, {}).objects)
        await app.close()
        return found

    first, second = run_with_sockets(objects())
    assert second - first < 100


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
    life = lived_for_real(tmp_path / "minute", 1.0 / 60.0)
    assert life.defects == []
    assert life.samples[-1].time_s >= 60.0
    assert life.counts["fault"] >= 1
    assert (tmp_path / "minute" / LOGS).is_dir()
    assert (tmp_path / "minute" / RUNS).is_dir()


def test_the_same_seed_lives_the_same_life(tmp_path: Path) -> None:
    first, second = (lived_for_real(tmp_path / name, 0.003) for name in ("first", "second"))
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


def lived_for_real(folder: Path, hours: float) -> Life:
    folder.mkdir()
    return live(MAX2D, hours, 2, folder, folder / "samples.jsonl", lambda *_: None)
