"""The same commands end alike over CAN and over the serial line of one drive."""

from __future__ import annotations

from typing import Any

import pytest

from canhelm.errors import CanhelmError
from vcan_tests.robot import running_robot

SEQUENCE: tuple[tuple[str, dict[str, Any], int], ...] = (
    ("motor.enable", {"node": 2}, 0),
    ("motor.velocity", {"node": 2, "velocity_rpm": 150.0, "duration_s": 1.0}, 0),
    ("motor.velocity", {"node": 1, "velocity_rpm": -150.0, "duration_s": 1.0}, 0),
    ("motor.disable", {"node": 2}, 0),
    ("brake.release", {"pair": "front"}, 0),
    ("motor.velocity", {"node": 3, "velocity_rpm": 100.0, "duration_s": 1.0}, 6),
    ("brake.engage", {"pair": "front"}, 0),
    ("steer", {"pair": "front", "angle_deg": 15.0}, 0),
    ("steer", {"pair": "rear", "angle_deg": -15.0}, 0),
    ("steer", {"pair": "front", "angle_deg": 88.0}, 1),
    ("drive.turn", {"rear_deg": -15.0, "front_deg": 15.0, "speed_m_s": 0.3, "duration_s": 1.0}, 0),
    ("drive.parallel", {"angle_deg": 0.0, "speed_m_s": 9.0, "duration_s": 1.0}, 1),
    ("drive.rotate", {"rate_deg_s": 10.0}, 1),
    ("motor.velocity", {"node": 77, "velocity_rpm": 100.0, "duration_s": 1.0}, 4),
    ("estop", {}, 0),
    ("steer", {"pair": "front", "angle_deg": 0.0}, 6),
    ("reset", {}, 0),
    ("steer", {"pair": "front", "angle_deg": 0.0}, 0),
)
"""Methods, parameters, and the exit codes that the command line makes of their outcomes."""


@pytest.mark.parametrize("bus", ["simulated", "rs232", "rs232@38400"])
async def test_the_same_commands_end_alike_over_can_and_over_a_serial_line(bus: str) -> None:
    async with running_robot(bus=bus, expect_errors=True) as robot:
        for method, params, code in SEQUENCE:
            try:
                await robot.call(method, **params)
                ended = 0
            except CanhelmError as error:
                ended = error.exit_code
            assert (method, params, ended) == (method, params, code)
        status = robot.app.service.status()
        assert status["state"] == "idle"
        assert [brake["state"] for brake in status["brakes"]] == ["engaged", "engaged"]
        assert status["vehicle"]["heading_deg"]["front"] == pytest.approx(0.0, abs=1.0)
        assert status["vehicle"]["heading_deg"]["rear"] == pytest.approx(-15.0, abs=1.0)
