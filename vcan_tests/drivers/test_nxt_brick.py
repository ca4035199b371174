from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest

from canhelm.errors import Aborted, BusOff, NodeAbsent, NotReady, Refused, Timeout
from drivers.contract import NodeState
from drivers.nxt import replies, requests
from drivers.nxt.brick import Brick, BrickSettings
from drivers.nxt.codes import Output, RunState
from drivers.nxt.line import QUEUE_DEPTH, BrickLine
from drivers.nxt.power import regulated_power
from drivers.nxt.telegrams import make_frame
from drivers.simulated.nxt import SimulatedNxt
from drivers.simulated.nxt_link import LinkEnd, SimulatedLink

BOTH = {Output.B: (50.0, 360.0), Output.C: (50.0, 360.0)}
FAST = BrickSettings(reach_s=0.5)


class Bench:
    def __init__(self) -> None:
        self.nxt = SimulatedNxt("Rover")
        self.link = SimulatedLink(self.nxt)
        self.told: list[str] = []
        self.brick = Brick("rfcomm0", self.link.connect, FAST)
        self.brick.on_change = self.told.append

    async def begin(self) -> Bench:
        self.brick.start()
        await self.brick.wait_ready()
        return self

    def turned(self) -> list[int]:
        self.nxt.catch_up()
        return [motor.state(0).tacho_deg for motor in self.nxt.motors]

    def turning(self) -> bool:
        self.nxt.catch_up()
        return any(abs(motor.speed_rad_s) > 0.1 for motor in self.nxt.motors)


@pytest.fixture
async def bench() -> AsyncIterator[Bench]:
    made = await Bench().begin()
    yield made
    await made.brick.close()


async def elapsed_s(since_s: float) -> float:
    return asyncio.get_running_loop().time() - since_s


# The connection


async def test_a_brick_that_is_connected_says_who_it_is(bench: Bench) -> None:
    assert bench.brick.node_state is NodeState.READY
    status = bench.brick.status()
    assert (status["brick"], status["firmware"], status["address"]) == ("Rover", "1.31", "00:16:53:01:02:03")
    assert bench.told == ["Rover is connected, battery 8.0 V"]


async def test_its_status_tells_what_went_over_the_line_and_what_was_dropped(bench: Bench) -> None:
    assert bench.nxt.cable.host is not None
    bench.nxt.cable.host(b"\x00\x00junk", 0.0)
    line = bench.brick.status()["line"]
    assert (line["sent"] >= line["replies"] > 0, line["bad_replies"], line["dropped_bytes"]) == (True, 0, 6)


async def test_a_question_takes_two_turns_of_the_radio(bench: Bench) -> None:
    loop = asyncio.get_running_loop()
    began_s = loop.time()
    for _ in range(10):
        await bench.brick.output(Output.B)
    assert 0.06 < (loop.time() - began_s) / 10 < 0.07


async def test_questions_at_once_go_one_after_the_other(bench: Bench) -> None:
    states = await asyncio.gather(*(bench.brick.output(Output(port)) for port in (0, 1, 2, 0)))
    assert [state.port for state in states] == [0, 1, 2, 0]


async def test_a_refusal_names_the_status_and_its_remedy(bench: Bench) -> None:
    with pytest.raises(Aborted, match=r"StopProgram: no program is running \(0xEC\)") as refusal:
        await bench.brick.ask(requests.StopProgram())
    assert refusal.value.value == 0xEC
    assert refusal.value.remedy


async def test_a_lost_connection_is_told_at_once_and_made_again(bench: Bench) -> None:
    bench.link.drop()
    await asyncio.sleep(0.01)
    assert bench.brick.node_state is NodeState.ABSENT
    assert "gone: out of reach" in bench.told[-1]
    await asyncio.wait_for(bench.brick.wait_ready(), 2.0)
    assert (bench.brick.connections, bench.brick.losses) == (2, 1)


async def test_a_brick_that_falls_silent_is_noticed_within_a_second_of_a_question(bench: Bench) -> None:
    bench.nxt.mute = True
    began_s = asyncio.get_running_loop().time()
    with pytest.raises(Timeout, match="did not reply to GetOutputState"):
        await bench.brick.output(Output.B)
    assert await elapsed_s(began_s) < 1.0
    await asyncio.sleep(0)
    assert bench.brick.node_state is NodeState.ABSENT


async def test_an_idle_brick_that_falls_silent_is_noticed_by_the_keep_alive(bench: Bench) -> None:
    bench.nxt.mute = True
    await asyncio.sleep(FAST.watch_s + 1.0)
    assert bench.brick.node_state is NodeState.ABSENT


async def test_a_brick_that_is_not_there_is_tried_again_and_told_once() -> None:
    bench = Bench()
    bench.link.reachable = False
    bench.brick.start()
    await asyncio.sleep(5.5)
    assert len(bench.told) == 1
    with pytest.raises(NodeAbsent, match="no brick in reach"):
        await bench.brick.move(BOTH)
    bench.link.reachable = True
    await asyncio.wait_for(bench.brick.wait_ready(), 2.0)
    await bench.brick.close()


async def test_the_keep_alive_keeps_the_brick_awake(bench: Bench) -> None:
    bench.nxt.sleep_limit_s = 8.0
    await asyncio.sleep(60.0)
    assert bench.brick.losses == 0


async def test_everything_that_waits_fails_with_the_connection(bench: Bench) -> None:
    questions = [asyncio.ensure_future(bench.brick.output(Output.B)) for _ in range(3)]
    await asyncio.sleep(0.01)
    bench.link.drop()
    results = await asyncio.gather(*questions, return_exceptions=True)
    assert all(isinstance(result, BusOff) for result in results)


async def test_too_many_questions_are_refused(bench: Bench) -> None:
    questions = [asyncio.ensure_future(bench.brick.output(Output.B)) for _ in range(QUEUE_DEPTH + 2)]
    results = await asyncio.gather(*questions, return_exceptions=True)
    assert sum(isinstance(result, NotReady) for result in results) == 1


async def test_what_nobody_asked_for_is_counted_and_dropped() -> None:
    nxt = SimulatedNxt()
    line = BrickLine(LinkEnd(nxt.cable), "rfcomm0")
    for data in (make_frame(b"\x02\x0b\x00\x28\x23"), make_frame(b"\x00\x0b"), b"\x00\x00junk"):
        assert nxt.cable.host is not None
        nxt.cable.host(data, 0.0)
    assert (line.counters.unexpected, line.counters.bad_replies, line.counters.dropped_bytes) == (1, 1, 6)
    assert isinstance(await line.ask(requests.GetBatteryLevel()), replies.BatteryLevel)


async def test_a_question_that_was_called_off_does_not_hold_up_the_next(bench: Bench) -> None:
    with pytest.raises(TimeoutError):
        await asyncio.wait_for(bench.brick.output(Output.A), 0.01)
    assert (await bench.brick.output(Output.C)).port == Output.C


# The battery


async def test_a_low_battery_is_told_once_and_moves_go_on(bench: Bench) -> None:
    bench.nxt.battery_v = 6.7
    await asyncio.sleep(30.0)
    assert [sentence for sentence in bench.told if "is low: 6.7 V" in sentence] == bench.told[1:]
    await bench.brick.move(BOTH)


async def test_with_an_empty_battery_no_move_begins(bench: Bench) -> None:
    bench.nxt.battery_v = 6.0
    await bench.brick.read_battery()
    with pytest.raises(NotReady, match=r"only 6\.0 V") as refusal:
        await bench.brick.move(BOTH)
    assert refusal.value.remedy
    assert not bench.turning()


# The motors


async def test_a_move_ends_when_all_its_motors_are_idle(bench: Bench) -> None:
    await bench.brick.move({Output.B: (50, 360), Output.C: (25, -180)})
    await asyncio.sleep(0.5)
    still, right, left = bench.turned()
    assert still == 0
    assert 360 <= right <= 540
    assert -270 <= left <= -180
    assert (await bench.brick.output(Output.B)).run_state == RunState.IDLE


async def test_a_motor_with_nothing_to_turn_is_left_alone(bench: Bench) -> None:
    await bench.brick.move({Output.B: (50, 360), Output.C: (0, 0.2)})
    assert bench.turned()[2] == 0


async def test_a_move_without_power_makes_no_sense(bench: Bench) -> None:
    with pytest.raises(ValueError, match="at power 0"):
        await bench.brick.move({Output.B: (0, 360)})


async def test_a_blocked_motor_is_stopped_and_told(bench: Bench) -> None:
    bench.nxt.motors[Output.C].blocked = True
    with pytest.raises(Timeout, match="motors B, C of rfcomm0 did not arrive") as trouble:
        await bench.brick.move(BOTH)
    assert trouble.value.remedy
    bench.nxt.motors[Output.C].blocked = False
    await asyncio.sleep(0.5)
    assert not bench.turning()


async def test_a_stop_ends_the_move_and_the_motors_at_once(bench: Bench) -> None:
    move = asyncio.ensure_future(bench.brick.move({Output.B: (50, 3600)}))
    await asyncio.sleep(1.0)
    bench.brick.stop()
    await asyncio.sleep(0.3)
    assert not bench.turning()
    with pytest.raises(Refused, match="were stopped"):
        await move


async def test_a_stop_goes_before_the_orders_that_wait(bench: Bench) -> None:
    question = asyncio.ensure_future(bench.brick.output(Output.B))
    await asyncio.sleep(0)
    bench.brick.run({Output.B: 50})
    bench.brick.stop()
    await question
    await asyncio.sleep(0.5)
    assert bench.turned()[1] == 0


async def test_a_move_that_is_called_off_stops_the_motors(bench: Bench) -> None:
    with pytest.raises(TimeoutError):
        await asyncio.wait_for(bench.brick.move({Output.B: (50, 3600)}), 1.0)
    await asyncio.sleep(0.3)
    assert not bench.turning()


async def test_two_moves_at_once_are_refused(bench: Bench) -> None:
    move = asyncio.ensure_future(bench.brick.move(BOTH))
    await asyncio.sleep(0.1)
    with pytest.raises(NotReady, match="in the middle of a move"):
        await bench.brick.move(BOTH)
    await move


async def test_after_a_broken_move_the_next_one_is_not_longer(bench: Bench) -> None:
    with pytest.raises(TimeoutError):
        await asyncio.wait_for(bench.brick.move({Output.B: (50, 3600)}), 1.0)
    await asyncio.sleep(0.3)
    before = bench.turned()[1]
    await bench.brick.move({Output.B: (50, 360)})
    await asyncio.sleep(0.5)
    assert 360 <= bench.turned()[1] - before <= 540


async def test_moves_in_a_row_do_not_add_up_what_they_overshoot(bench: Bench) -> None:
    for _ in range(5):
        await bench.brick.move({Output.B: (40, 360)})
    await asyncio.sleep(0.5)
    assert 5 * 360 <= bench.turned()[1] <= 5 * 360 + 120


async def test_a_speed_lasts_only_as_long_as_it_is_set_again(bench: Bench) -> None:
    for _ in range(10):
        bench.brick.run({Output.B: 40, Output.C: -40})
        await asyncio.sleep(0.2)
    assert bench.turning()
    await asyncio.sleep(1.5)
    assert not bench.turning()


async def test_a_pulled_cable_lets_no_motor_run_on(bench: Bench) -> None:
    bench.brick.run({Output.B: 50, Output.C: 50})
    await asyncio.sleep(0.4)
    bench.link.reachable = False
    bench.link.drop()
    assert bench.turning()
    await asyncio.sleep(1.2)
    assert not bench.turning()


async def test_after_a_reconnection_nothing_starts_by_itself(bench: Bench) -> None:
    move = asyncio.ensure_future(bench.brick.move({Output.B: (30, 3600)}))
    await asyncio.sleep(1.0)
    bench.link.drop()
    with pytest.raises(BusOff):
        await move
    assert bench.turning()
    await bench.brick.wait_ready()
    await asyncio.sleep(0.3)
    stopped_at = bench.turned()
    await asyncio.sleep(3.0)
    assert bench.turned() == stopped_at


async def test_closing_stops_the_motors() -> None:
    bench = await Bench().begin()
    bench.brick.run({Output.B: 50})
    await asyncio.sleep(0.2)
    await bench.brick.close()
    await asyncio.sleep(0.2)
    assert not bench.turning()
    assert bench.brick.node_state is NodeState.ABSENT


@pytest.mark.parametrize(
    ("speed", "power"), [(0.0, 0), (17.4533, 100), (-8.7266, -50), (0.01, 1), (-0.01, -1), (99, 100)]
)
def test_a_speed_has_its_power(speed: float, power: int) -> None:
    assert regulated_power(speed) == power
