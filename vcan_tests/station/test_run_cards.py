"""The runs on a phone: a card for each, no wider than the screen."""

from __future__ import annotations

import pytest

from vcan_tests.station.accessibility import findings
from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import Robot
from vcan_tests.station.test_views import NARROW, TOO_WIDE

pytestmark = pytest.mark.station

CELLS = """() => [...document.querySelectorAll(".runs tbody tr:first-child > *")]
    .map(cell => Math.round(cell.getBoundingClientRect().left))"""


def test_each_run_is_a_card_whose_facts_stand_below_each_other(meet: Meet, robot: Robot) -> None:
    robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.2, duration_s=0.3, wait=True)
    operator = meet(**NARROW)
    operator.open(robot.name)
    operator.go_to("runs")
    operator.sees(".runs", r"\d+ runs?")
    assert len(set(operator.page.evaluate(CELLS))) == 1
    assert operator.page.evaluate("() => document.querySelector('.runs .scroll').scrollWidth") <= 320
    assert operator.page.evaluate(TOO_WIDE) == []
    assert findings(operator.page) == []
