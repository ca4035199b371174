"""What a driver with a pad asks its daemon for, by a daemon that writes it down."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Any

import pytest

from canhelm.errors import CanhelmError, DaemonNotRunning, DeviceFault, EmergencyStop, Refused
from daemon.gamepad.driver import PadDriver
from daemon.gamepad.mapping import Mapping
from vcan_tests.daemon.gamepad.recorded_pad import RecordedPad

SPEED = {"axis": "ABS_Y", "sign": -1, "dead_zone": 0.1, "exponent": 1.0, "least": -1.0, "full": 1.0, "unit": "m/s"}
TOLD = {
    "sticks": {"speed": SPEED},
    "buttons": {"dead_man": "BTN_TL", "stop": "BTN_SOUTH", "emergency_stop": "BTN_EAST"},
    "taken_at_rest": [],
    "silence_s": 5.0,
    "rest_s": 1.0,
}


class ToldDaemon:
    """A daemon that does nothing but remember.

    Attributes:
        calls: time, method and parameters.
        refusal: what drive.set is refused with.
        stop_failure: what stops fail with.
        delay_s: that each answer to drive.set takes.
        rest_s: that stops take.
        motion: the one that runs, or ran last.
    """

    def __init__(self) -> None:
        self.calls: list[tuple[float, str, dict[str, Any]]] = []
        self.refusal: CanhelmError | None = None
        self.stop_failure: CanhelmError | None = None
        self.delay_s = 0.0
        self.rest_s = 0.5
        self.motion = 0
        self._end: asyncio.Future[dict[str, Any]] | None = None

    async def call(self, method: str, /, **params: Any) -> dict[str, Any]:
        self.calls.append((asyncio.get_running_loop().time(), method, params))
        if method == "drive.set":
            return await self._set()
        if method == "motion.wait":
            assert self._end is not None
            return await asyncio.shield(self._end)
        await asyncio.sleep(self.rest_s)
        if self.stop_failure:
            self.end(self.stop_failure)
            raise self.stop_failure
        self.end(Refused("the motion was stopped"))
        return {}

    async def _set(self) -> dict[str, Any]:
        await asyncio.sleep(self.delay_s)
        if self.refusal:
            raise self.refusal
        if self._end is None:
            self.motion += 1
            self._end = asyncio.get_running_loop().create_future()
        return {"motion": str(self.motion)}

    def end(self, error: CanhelmError) -> None:
        """The motion is over."""
        if self._end is not None:
            self._end.set_exception(error)
            self._end = None

    def asked(self, method: str) -> list[tuple[float, dict[str, Any]]]:
        """Times and parameters of the calls of one method."""
        return [(when, params) for when, name, params in self.calls if name == method]


class Hands:
    """A driver with a pad in its hands, at a daemon that remembers."""

    def __init__(self) -> None:
        self.daemon, self.held = ToldDaemon(), RecordedPad()
        self.told: list[str] = []
        self.drawn: list[str] = []
        self.driver = PadDriver(self.daemon, Mapping(TOLD), self.told.append, self.drawn.append)
        self.driving = asyncio.create_task(self.driver.drive(self.held.pad))

    async def begin(self) -> None:
        """Hold the button, and push the stick half way between dead zone and end."""
        await asyncio.sleep(0.1)
        self.held.press("BTN_TL")
        await asyncio.sleep(0.1)
        self.held.move("ABS_Y", -0.55)
        await asyncio.sleep(0.2)

    @property
    def speeds(self) -> list[float]:
        """What was asked for."""
        return [params["speed_m_s"] for _, params in self.daemon.asked("drive.set")]


@pytest.fixture
async def hands() -> AsyncIterator[Hands]:
    made = Hands()
    yield made
    made.driving.cancel()
    await asyncio.wait([made.driving])


async def test_set_points_come_twenty_times_a_second_and_are_good_for_a_fifth(hands: Hands) -> None:
    await hands.begin()
    count = len(hands.speeds)
    await asyncio.sleep(1.0)
    assert len(hands.speeds) - count == pytest.approx(20, abs=1)
    assert hands.speeds[-1] == pytest.approx(0.5, abs=1e-3)
    assert hands.daemon.asked("drive.set")[-1][1]["valid_for_ms"] == 200.0


async def test_without_the_dead_man_button_nothing_is_asked_for(hands: Hands) -> None:
    hands.held.move("ABS_Y", -1.0)
    await asyncio.sleep(1.0)
    assert hands.daemon.calls == []


async def test_letting_go_stops_the_motion_at_once(hands: Hands) -> None:
    await hands.begin()
    await asyncio.sleep(0.013)
    hands.held.let_go("BTN_TL")
    let_go_s = asyncio.get_running_loop().time()
    await asyncio.sleep(1.0)
    assert hands.daemon.asked("motion.stop") == [(let_go_s, {"motion": "1"})]
    assert hands.daemon.asked("drive.set")[-1][0] <= let_go_s


async def test_a_short_let_go_between_two_set_points_counts(hands: Hands) -> None:
    await hands.begin()
    hands.held.let_go("BTN_TL")
    hands.held.press("BTN_TL")
    await asyncio.sleep(1.0)
    assert len(hands.daemon.asked("motion.stop")) == 1


async def test_a_pad_that_has_gone_stops_the_motion_at_once(hands: Hands) -> None:
    await hands.begin()
    await asyncio.sleep(0.02)
    hands.held.pad.lose("No such device")
    gone_s = asyncio.get_running_loop().time()
    await hands.driving
    assert hands.daemon.asked("motion.stop") == [(gone_s, {"motion": "1"})]
    assert hands.told[-1] == "Recorded Pad has gone (No such device): the robot is at rest"


async def test_an_emergency_stop_pressed_while_an_answer_is_waited_for_counts_on_a_pad_that_goes_then(
    hands: Hands,
) -> None:
    await hands.begin()
    hands.daemon.delay_s = 0.5
    await asyncio.sleep(0.1)
    hands.held.press("BTN_EAST")
    hands.held.pad.lose("No such device")
    await hands.driving
    assert len(hands.daemon.asked("estop")) == 1


async def test_a_pad_that_comes_back_with_its_button_held_does_not_drive(hands: Hands) -> None:
    await hands.begin()
    hands.held.pad.lose("No such device")
    await hands.driving
    count = len(hands.speeds)
    back = RecordedPad(pressed=("BTN_TL",))
    hands.driving = asyncio.create_task(hands.driver.drive(back.pad))
    await asyncio.sleep(0.5)
    back.move("ABS_Y", -1.0)
    await asyncio.sleep(0.5)
    back.let_go("BTN_TL")
    await asyncio.sleep(0.5)
    back.press("BTN_TL")
    await asyncio.sleep(0.5)
    assert len(hands.speeds) == count
    back.move("ABS_Y", 0.0)
    await asyncio.sleep(0.5)
    assert len(hands.speeds) > count
    assert set(hands.speeds[count:]) == {0.0}


async def test_a_pad_that_says_nothing_while_it_drives_counts_as_lost(hands: Hands) -> None:
    await hands.begin()
    await asyncio.sleep(6.0)
    last_s, _ = hands.daemon.asked("drive.set")[-1]
    assert last_s == pytest.approx(hands.held.pad.heard_s + 5.0, abs=0.06)
    assert "asleep" in hands.told[-2]
    hands.held.move("ABS_Y", -0.5)
    await asyncio.sleep(0.5)
    assert hands.daemon.asked("drive.set")[-1][0] == last_s


async def test_a_pad_that_rests_in_its_hands_may_be_silent(hands: Hands) -> None:
    await hands.begin()
    hands.held.move("ABS_Y", 0.0)
    await asyncio.sleep(20.0)
    assert not hands.daemon.asked("motion.stop")


@pytest.mark.parametrize(("button", "method"), [("BTN_SOUTH", "stop"), ("BTN_EAST", "estop")])
async def test_stop_buttons_work_without_the_dead_man(hands: Hands, button: str, method: str) -> None:
    await asyncio.sleep(0.1)
    hands.held.press(button)
    pressed_s = asyncio.get_running_loop().time()
    await asyncio.sleep(0.1)
    assert [when for when, _ in hands.daemon.asked(method)] == [pressed_s]


async def test_an_emergency_stop_does_not_wait_for_a_stop_under_way(hands: Hands) -> None:
    hands.daemon.rest_s = 3.0
    await hands.begin()
    hands.held.press("BTN_SOUTH")
    await asyncio.sleep(0.1)
    hands.held.press("BTN_EAST")
    pressed_s = asyncio.get_running_loop().time()
    await asyncio.sleep(0.1)
    assert [when for when, _ in hands.daemon.asked("estop")] == [pressed_s]


async def test_what_is_refused_is_told_once_and_needs_a_new_press(hands: Hands) -> None:
    hands.daemon.refusal = EmergencyStop("the emergency stop is latched", remedy="`canhelm reset`")
    await hands.begin()
    await asyncio.sleep(2.0)
    assert len(hands.speeds) == 1
    assert [told for told in hands.told if "latched (`canhelm reset`)" in told] == hands.told


async def test_a_motion_that_ends_by_itself_is_not_begun_anew(hands: Hands) -> None:
    await hands.begin()
    hands.daemon.end(DeviceFault("the pair does not turn"))
    await asyncio.sleep(2.0)
    assert hands.daemon.motion == 1
    assert "the pair does not turn" in hands.told[-1]


async def test_a_motion_that_was_replaced_before_its_end_was_heard_of_is_stopped(hands: Hands) -> None:
    await hands.begin()
    hands.daemon.delay_s = 0.1
    asyncio.get_running_loop().call_later(0.06, hands.daemon.end, DeviceFault("the pair does not turn"))
    await asyncio.sleep(2.0)
    assert hands.daemon.asked("motion.stop")[0][1] == {"motion": "2"}
    assert any("the pair does not turn" in told for told in hands.told)


async def test_an_answer_that_came_late_needs_a_new_press(hands: Hands) -> None:
    await hands.begin()
    hands.daemon.delay_s = 3.0
    await asyncio.sleep(4.0)
    count = len(hands.speeds)
    await asyncio.sleep(4.0)
    assert len(hands.speeds) == count
    assert any("answered after 3.0 s" in told for told in hands.told)


async def test_a_lost_daemon_ends_it(hands: Hands) -> None:
    await hands.begin()
    hands.daemon.refusal = DaemonNotRunning("the daemon hung up")
    with pytest.raises(DaemonNotRunning):
        await hands.driving


async def test_a_daemon_that_is_lost_while_the_robot_stops_is_not_told_as_rest(hands: Hands) -> None:
    await hands.begin()
    hands.daemon.stop_failure = DaemonNotRunning("the daemon hung up")
    hands.held.pad.lose("No such device")
    with pytest.raises(DaemonNotRunning):
        await hands.driving
    assert not any("at rest" in told for told in hands.told)


async def test_a_stop_that_fails_is_told_and_the_buttons_go_on_working(hands: Hands) -> None:
    hands.daemon.stop_failure = DeviceFault("rear_left does not come to rest")
    await asyncio.sleep(0.1)
    hands.held.press("BTN_SOUTH")
    await asyncio.sleep(1.0)
    hands.held.press("BTN_EAST")
    await asyncio.sleep(0.1)
    assert any("rear_left does not come to rest" in told for told in hands.told)
    assert len(hands.daemon.asked("estop")) == 1


async def test_whoever_interrupts_it_leaves_the_robot_at_rest(hands: Hands) -> None:
    await hands.begin()
    hands.driving.cancel()
    await asyncio.wait([hands.driving])
    assert hands.driving.cancelled()
    assert len(hands.daemon.asked("motion.stop")) == 1


async def test_pressed_again_it_waits_until_the_robot_is_at_rest(hands: Hands) -> None:
    await hands.begin()
    hands.held.move("ABS_Y", 0.0)
    hands.held.let_go("BTN_TL")
    await asyncio.sleep(0.1)
    stopped_s, _ = hands.daemon.asked("motion.stop")[0]
    hands.held.press("BTN_TL")
    await asyncio.sleep(2.0)
    again = [when for when, _ in hands.daemon.asked("drive.set") if when > stopped_s]
    assert again[0] >= stopped_s + hands.daemon.rest_s
    assert hands.daemon.motion == 2


async def test_what_is_commanded_is_shown(hands: Hands) -> None:
    await hands.begin()
    assert hands.drawn[-1] == "speed 0.50 m/s"
    assert hands.told == ["driving"]
