"""A setup that is broken off, gets no answer or goes wrong leaves the robot as it was."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest

from canhelm.errors import Refused
from daemon.commissioning.session import GivenUp, commission
from daemon.commissioning.wheels import Findings
from vcan_tests.daemon.workshop import Workshop, robot_file, workshop
from vcan_tests.daemon.workshop_person import WorkshopPerson


async def test_the_current_is_capped_meanwhile_and_then_as_before(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        drive = shop.robot.network.drives["rear_left"]

        class Curious(WorkshopPerson):
            async def ask(self, question: str) -> str:
                if question.startswith("which wheel"):
                    assert drive.dictionary.number("output_current_limit") == 500
                return await super().ask(question)

        shop.person = Curious(shop.call)
        await shop.commission("rear_left")
        assert drive.dictionary.number("output_current_limit") == 5000
        assert "  rear_left output_current_limit: 5000 mA -> 500 mA" in shop.person.heard


async def test_breaking_off_puts_everything_back(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        working = asyncio.create_task(shop.commission())
        await shop.robot.until(lambda: shop.robot.state == "active")
        working.cancel()
        await asyncio.wait([working])
        assert (working.cancelled(), shop.robot.state) == (True, "idle")
        limits = {drive.dictionary.number("output_current_limit") for drive in shop.robot.network.drives.values()}
        assert limits == {5000}
        assert all(brake.engaged for brake in shop.robot.network.brakes.values())


async def lower(shop: Workshop) -> list[int]:
    """Begin a setup, and lower the limits of one drive; what those of all drives were."""
    limits = current_limits(shop)
    await shop.call("setup.begin")
    await shop.call("setup.lower", node="rear_left", current_ma=500)
    assert current_limits(shop) != limits
    return limits


async def test_a_lease_that_runs_out_puts_everything_back_and_ends_the_setup(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        limits = await lower(shop)
        await shop.robot.fall_silent()
        await shop.robot.until(lambda: shop.robot.app.supervisor.setup_lease is None)
        assert current_limits(shop) == limits
        with pytest.raises(Refused, match="this setup is over"):
            await shop.call("setup.lower", node="rear_left", current_ma=500)


async def test_a_daemon_that_goes_down_meanwhile_puts_the_limits_back(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        limits = await lower(shop)
        await shop.robot.app.supervisor.close()
        assert current_limits(shop) == limits


async def test_once_the_daemon_has_gone_down_nothing_is_lowered_any_more(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        await shop.call("setup.begin")
        await shop.robot.app.supervisor.close()
        with pytest.raises(Refused, match="this setup is over"):
            await shop.call("setup.lower", node="rear_left", current_ma=500)


async def test_limits_whose_return_is_cut_off_come_back_with_the_end(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        limits = await lower(shop)
        await shop.call("simulation.fault", kind="lose", cob_id=0x602, times=1)
        restoring = asyncio.create_task(shop.call("setup.restore"))
        await asyncio.sleep(0.01)
        restoring.cancel()
        await asyncio.wait([restoring])
        assert current_limits(shop) != limits
        await shop.call("setup.end")
        assert current_limits(shop) == limits


class Interrupted:
    """A daemon and a person; Ctrl-C comes at a certain step, be it a question or a call that is under way.

    A call that was begun goes on in the daemon, as one does whose client has gone.
    """

    def __init__(self, shop: Workshop, step: int) -> None:
        self._shop = shop
        self._left = step
        self.begun: list[asyncio.Task[dict[str, Any]]] = []
        self.working: asyncio.Task[Findings]

    async def call(self, method: str, /, **params: Any) -> dict[str, Any]:
        self.begun.append(asyncio.create_task(self._shop.call(method, **params)))
        self._step()
        return await asyncio.shield(self.begun[-1])

    async def ask(self, question: str) -> str:
        self._step()
        await asyncio.sleep(0.0)
        return await self._shop.person.ask(question)

    def tell(self, text: str) -> None:
        self._shop.person.tell(text)

    def _step(self) -> None:
        self._left -= 1
        if not self._left:
            self.working.cancel()


@pytest.mark.parametrize("what", ["rear_left", "pairs"])
async def test_ctrl_c_at_any_step_leaves_everything_as_it_was(
    what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("daemon.commissioning.wheels.JOG_S", 0.2)
    for room in ("body", "workshop"):
        monkeypatch.setattr(f"drivers.simulated.{room}.HAND_RAD_S", 100.0)
    file = robot_file(tmp_path)
    async with workshop(file) as shop:
        limits, step = current_limits(shop), 0
        while True:
            step += 1
            steps = Interrupted(shop, step)
            steps.working = asyncio.create_task(commission(steps, steps, shop.profile, what, 500))
            await asyncio.wait([steps.working])
            await asyncio.gather(*steps.begun, return_exceptions=True)
            assert (step, current_limits(shop), shop.robot.state) == (step, limits, "idle")
            assert all(brake.engaged for brake in shop.robot.network.brakes.values())
            if not steps.working.cancelled():
                break
        assert step > 15
    assert not file.with_suffix(".calibration.yaml").exists()


def current_limits(shop: Workshop) -> list[int]:
    """Of all drives [mA]."""
    names = ("continuous_current_limit", "output_current_limit")
    return [drive.dictionary.number(name) for drive in shop.robot.network.drives.values() for name in names]


@pytest.mark.parametrize(("again", "unsolved"), [("y", 0), ("n", 1)])
async def test_a_drive_that_faults_is_tried_again_or_left(again: str, unsolved: int, tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        faults = [0x2310]

        class Patient(WorkshopPerson):
            async def ask(self, question: str) -> str:
                if "press Enter and watch" in question and faults:
                    soon = asyncio.get_running_loop().time() + 1.0
                    asyncio.get_running_loop().call_at(soon, drive.trigger_fault, faults.pop())
                return again if question.startswith("try") else await super().ask(question)

        drive = shop.robot.network.drives["rear_left"]
        shop.person = Patient(shop.call)
        findings = await shop.commission("rear_left")
        assert any("over-current (0x2310)" in heard for heard in shop.person.heard)
        assert len(findings.unsolved) == unsolved


class Lazy(WorkshopPerson):
    """Somebody who presses Enter without having turned the wheel, and says later what a look at it tells."""

    lazy = 1
    turned = "n"

    async def ask(self, question: str) -> str:
        if question.startswith("turn wheel") and self.lazy:
            self.lazy -= 1
            return ""
        return self.turned if question.startswith("has wheel") else await super().ask(question)


async def test_a_wheel_that_was_not_turned_by_hand_is_asked_for_again(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        shop.person = Lazy(shop.call)
        findings = await shop.commission("rear_left")
        assert "0 counts of about 56000: not turned, or not connected with its motor" in shop.person.heard
        assert (findings.wrong, findings.unsolved) == ([], [])


async def test_a_wheel_that_turns_without_its_motor_is_loose(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        shop.person = Lazy(shop.call)
        shop.person.turned = "y"
        findings = await shop.commission("rear_left")
        assert "is the wheel loose on its shaft?" in findings.unsolved[0]


async def test_who_says_no_gets_nothing_changed(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:

        class Cautious(WorkshopPerson):
            async def ask(self, question: str) -> str:
                return "n"

        shop.person = Cautious(shop.call)
        with pytest.raises(GivenUp):
            await shop.commission()
