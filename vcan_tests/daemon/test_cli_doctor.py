"""What the doctor finds, and the line that mends it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from daemon.cli.doctor_machine import (
    adapter_findings,
    bit_rate_findings,
    interface_finding,
    interface_findings,
    name_findings,
)
from daemon.cli.doctor_status import status_findings
from daemon.cli.finding import Finding
from daemon.cli.main import main
from drivers.bus.can_link import CanLink
from profiles.loader import SHIPPED
from vcan_tests.daemon.fake_backend import FakeBackend, served

READY = {"node": 1, "name": "rear_right", "node_state": "ready", "state": "disabled"}


def interface(folder: Path, name: str = "can0", flags: str = "0x1", queue: str = "1000", kind: str = "280") -> Path:
    where = folder / name
    where.mkdir()
    (where / "type").write_text(kind + "\n")
    (where / "flags").write_text(flags + "\n")
    (where / "tx_queue_len").write_text(queue + "\n")
    return where


def findings(earlier: dict[str, Any] | None = None, **status: Any) -> dict[str, Finding]:
    return {finding.check: finding for finding in status_findings({"state": "idle", **status}, earlier or {})}


def test_a_vehicle_that_waits_is_a_note_that_says_so_once() -> None:
    vehicle = findings(state="waiting", message="waiting for node 3")["vehicle"]
    assert (vehicle.verdict, vehicle.finding) == ("note", "waiting for node 3")


def test_an_interface_that_is_down_is_brought_up(tmp_path: Path) -> None:
    found = interface_finding("can0", interface(tmp_path, flags="0x0"), CanLink(1_000_000))
    assert (found.verdict, "ip link set can0 up type can bitrate" in found.mend) == ("problem", True)


def test_a_virtual_interface_needs_no_bit_rate(tmp_path: Path) -> None:
    found = interface_finding("vcan0", interface(tmp_path, "vcan0", flags="0x0"), CanLink())
    assert found.mend == "sudo ip link set vcan0 up"


def test_bus_off_is_a_problem(tmp_path: Path) -> None:
    found = interface_finding("can0", interface(tmp_path), CanLink(500_000, "BUS-OFF"))
    assert (found.verdict, "termination" in found.mend) == ("problem", True)


def test_a_short_queue_is_noted(tmp_path: Path) -> None:
    found = interface_finding("can0", interface(tmp_path, queue="10"), CanLink())
    assert (found.verdict, "txqueuelen" in found.mend) == ("note", True)


def test_a_controller_that_stays_bus_off_is_noted(tmp_path: Path) -> None:
    link = CanLink(1_000_000, "ERROR-ACTIVE", restart_ms=0)
    found = interface_finding("can0", interface(tmp_path), link)
    assert (found.verdict, "type can restart-ms 100" in found.mend) == ("note", True)


def test_a_controller_with_many_errors_is_noted(tmp_path: Path) -> None:
    found = interface_finding("can0", interface(tmp_path), CanLink(1_000_000, "ERROR-PASSIVE"))
    assert (found.verdict, "termination" in found.mend) == ("note", True)


def test_another_bit_rate_than_the_profiles_is_a_problem() -> None:
    (found,) = bit_rate_findings({"name": "can0", "bit_rate": 1_000_000}, CanLink(500_000))
    assert found.verdict == "problem"
    assert found.mend == (
        "sudo ip link set can0 down; sudo ip link set can0 up type can bitrate 1000000 restart-ms 100"
    )


def test_a_kernel_without_can_is_told_with_the_module_that_it_lacks(tmp_path: Path) -> None:
    (found,) = interface_findings(tmp_path, has_can=False)
    assert (found.verdict, found.mend.startswith("sudo modprobe can_raw")) == ("note", True)


@pytest.mark.parametrize(
    ("vendor", "product", "module"),
    [("1d50", "606f", "gs_usb"), ("0c72", "000c", "peak_usb"), ("0bfd", "0120", "kvaser_usb")],
)
def test_an_adapter_without_its_driver_is_told_with_the_module(
    tmp_path: Path, vendor: str, product: str, module: str
) -> None:
    adapter = tmp_path / "1-1"
    adapter.mkdir()
    (adapter / "idVendor").write_text(f"{vendor}\n")
    (adapter / "idProduct").write_text(f"{product}\n")
    (found,) = adapter_findings(tmp_path)
    assert (found.verdict, found.mend) == ("problem", f"sudo modprobe {module}")
    (adapter / "1-1:1.0" / "net" / "can0").mkdir(parents=True)
    assert not list(adapter_findings(tmp_path))


def test_a_daemon_on_an_interface_that_is_not_there_is_told_which_one_is(tmp_path: Path) -> None:
    interface(tmp_path)
    (found,) = name_findings({"name": "can7", "down": "No such device"}, tmp_path)
    assert found.finding == "there is no interface can7, but can0"
    assert "--bus socketcan:can0" in found.mend
    assert not list(name_findings({"name": "can0", "down": "Network is down"}, tmp_path))


def test_error_frames_and_nobody_who_answers_are_another_bit_rate() -> None:
    bus = {"name": "can0", "bit_rate": 1_000_000, "error_frames": 40}
    told = findings({"bus": {"error_frames": 12}}, bus=bus)["wire"]
    assert (told.verdict, "down; sudo ip link set can0 up type can bitrate 500000" in told.mend) == ("problem", True)
    assert "wire" not in findings({"bus": {"error_frames": 12}}, bus=bus, nodes=[READY])


def test_guarding_answers_out_of_turn_are_two_nodes_with_one_id() -> None:
    told = findings({"bus": {"toggle_errors": 2}}, bus={"toggle_errors": 21})["node ids"]
    assert (told.verdict, told.mend) == ("problem", "canhelm nodes scan")
    assert findings({"bus": {"toggle_errors": 21}}, bus={"toggle_errors": 21})["node ids"].verdict == "note"


@pytest.mark.parametrize(
    ("status", "words"),
    [
        ({"setup": "needed"}, "does not drive before"),
        ({"setup": "waived", "profile_file": "/etc/canhelm/robots/lab1.yaml"}, "its setup is waived"),
    ],
)
def test_a_robot_that_was_not_set_up_is_noted(status: dict[str, Any], words: str) -> None:
    told = findings(**status)["setup"]
    assert (told.verdict, words in told.finding) == ("note", True)


def test_a_robot_that_was_set_up_and_a_shipped_one_are_not() -> None:
    assert "setup" not in findings(setup="done")
    assert "setup" not in findings(setup="waived", profile_file=str(SHIPPED / "robots" / "max2d.yaml"))


@pytest.mark.parametrize("link", [CanLink(), CanLink(1_000_000)])
def test_the_right_bit_rate_and_an_unknown_one_are_no_finding(link: CanLink) -> None:
    assert not list(bit_rate_findings({"name": "can0", "bit_rate": 1_000_000}, link))


def test_an_interface_in_order_is_ok(tmp_path: Path) -> None:
    found = interface_finding("can0", interface(tmp_path), CanLink(1_000_000, "ERROR-ACTIVE"))
    assert (found.verdict, found.mend) == ("ok", "")


def test_other_interfaces_are_left_out(tmp_path: Path) -> None:
    interface(tmp_path, "eth0", kind="1")
    assert [found.check for found in interface_findings(tmp_path)] == ["can"]


def test_a_fault_names_its_remedy() -> None:
    fault = {"message": "over-current", "remedy": "look for a short circuit"}
    found = findings(nodes=[{**READY, "fault": fault}])["node 1 (rear_right)"]
    assert (found.verdict, found.mend) == ("problem", "look for a short circuit")


def test_a_node_that_is_waited_for_is_a_problem() -> None:
    found = findings(nodes=[{**READY, "node_state": "absent", "status": "no boot-up"}])["node 1 (rear_right)"]
    assert (found.verdict, found.finding) == ("problem", "no boot-up")


def test_a_node_that_is_being_configured_is_a_note_of_how_far_it_is() -> None:
    told = "node 1 (rear_right): writing its limits and ramps"
    node = {**READY, "node_state": "configuring", "status": told}
    found = findings(state="booting", nodes=[node])["node 1 (rear_right)"]
    assert (found.verdict, found.mend) == ("note", "")
    assert found.finding == "is being configured: writing its limits and ramps"


def test_a_brick_that_is_away_is_named_without_a_node_id_and_to_be_switched_on() -> None:
    node = {"node": None, "name": "right", "node_state": "absent", "status": "brick nxt: no brick in reach"}
    found = findings(state="waiting", nodes=[node])["right"]
    assert (found.verdict, found.mend) == ("problem", "switch the NXT brick on")


def test_an_emergency_stop_is_a_problem() -> None:
    assert findings(state="estop", message="emergency stop: by a person")["vehicle"].verdict == "problem"


@pytest.mark.parametrize(("late", "cycles", "verdict"), [(10, 10_000, "ok"), (11, 10_000, "problem"), (5, 809, "ok")])
def test_more_than_one_late_cycle_in_a_thousand_is_a_problem_if_they_are_more_than_five(
    late: int, cycles: int, verdict: str
) -> None:
    assert findings(cycle={"cycles": cycles, "late_cycles": late})["cycle"].verdict == verdict


def test_cycles_that_were_late_and_are_no_more_are_a_note() -> None:
    found = findings({"cycle": {"late_cycles": 60}}, cycle={"cycles": 10_000, "late_cycles": 60})["cycle"]
    assert (found.verdict, "60 of 10000" in found.finding) == ("note", True)
    assert found.finding.endswith("none in the last 1 s")


def test_the_time_for_which_a_simulated_robot_had_to_wait_is_told_with_the_cycle() -> None:
    found = findings(cycle={"cycles": 10_000, "late_cycles": 0, "stood_still_s": 2.34})["cycle"]
    assert (found.verdict, "waiting for 2.3 s" in found.finding) == ("ok", True)


@pytest.mark.parametrize("role", ["watch", "drive"])
def test_the_own_role_is_told_with_what_the_daemon_says_gives_more(role: str) -> None:
    finding = findings(role=role, role_remedy="log in with a token for configure")["role"]
    assert finding.verdict == "note"
    assert finding.mend == "for more: log in with a token for configure (docs/rights.md)"


def test_who_may_do_everything_is_told_of_no_other_role() -> None:
    assert (findings(role="configure")["role"].verdict, findings(role="configure")["role"].mend) == ("ok", "")


@pytest.mark.parametrize(("before", "verdict"), [(2, "problem"), (3, "note")])
def test_requests_that_failed_inside_the_daemon_are_a_problem_while_they_do(before: int, verdict: str) -> None:
    assert findings({"api": {"internal_errors": before}}, api={"internal_errors": 3})["api"].verdict == verdict


def test_a_cycle_that_was_late_by_more_than_a_period_is_noted() -> None:
    found = findings(cycle={"cycles": 10_000, "late_cycles": 1, "hz": 100.0, "max_lateness_ms": 63.25})["cycle"]
    assert (found.verdict, "63.2 ms late" in found.finding) == ("note", True)


@pytest.mark.parametrize(
    ("recording", "verdict"),
    [
        ({"failing": False, "lost": 0, "frames": 10}, "ok"),
        ({"failing": True, "lost": 0, "frames": 10}, "problem"),
        ({"failing": False, "lost": 3, "frames": 10}, "note"),
    ],
)
def test_a_log_that_cannot_be_written_is_told(recording: dict[str, Any], verdict: str) -> None:
    assert findings(recording={"path": "run.log", **recording})["recording"].verdict == verdict


def test_dropped_frames_are_a_problem() -> None:
    found = findings(bus={"load": 0.2, "dropped_full": 3})["bus"]
    assert (found.verdict, found.finding) == ("problem", "dropped_full 3")


@pytest.mark.parametrize("counter", ["dropped_full", "dropped_stale", "dropped_overflow"])
def test_frames_that_were_dropped_long_ago_are_a_note(counter: str) -> None:
    assert findings({"bus": {counter: 3}}, bus={"load": 0.2, counter: 3})["bus"].verdict == "note"


def test_a_bus_that_is_down_is_told_with_its_remedy() -> None:
    found = findings(bus={"name": "can0", "down": "bus-off", "remedy": "check wiring"})["bus"]
    assert (found.verdict, found.finding, found.mend) == ("problem", "can0 does not work: bus-off", "check wiring")


def test_frames_that_overflowed_the_receive_buffer_are_a_problem() -> None:
    found = findings(bus={"load": 0.9, "dropped_overflow": 12})["bus"]
    assert (found.verdict, "net.core.rmem_max" in found.mend) == ("problem", True)


@pytest.mark.parametrize(("frames", "verdict"), [(555, "note"), (10_922, "ok")])
def test_a_small_receive_buffer_is_noted(frames: int, verdict: str) -> None:
    assert findings(bus={"load": 0.1, "receive_buffer_frames": frames})["bus"].verdict == verdict


def test_a_healthy_daemon_has_no_problem() -> None:
    told = findings(nodes=[READY], cycle={"cycles": 100, "late_cycles": 0}, bus={"load": 0.1, "dropped_full": 0})
    assert {finding.verdict for finding in told.values()} == {"ok"}


def test_the_doctor_works_without_a_daemon(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr("canhelm.protocol.SYSTEM_FOLDER", tmp_path / "no-system")
    monkeypatch.setattr("daemon.cli.doctor.NETWORK_DEVICES", tmp_path)
    assert main(["doctor"]) == 0
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert {"python", "group", "can", "daemon"} == {row["check"] for row in rows}


def test_a_socket_on_which_nobody_answers_is_a_problem(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--socket", "/nonexistent/robot.sock"]) == 1


LINE = {
    "baud": 115200, "planned_hz": 16.1, "planned_hz_at_baud": {"115200": 16.1, "38400": 7.5}, "speed_limit_m_s": 0.9,
    "silent_line_stop_s": 1.4, "silent_line_stop_m": 1.5, "silent_line_turn_deg": 63,
    "resyncs": 0, "silent_nodes": [], "line_down": None,
}  # fmt: skip


def test_a_serial_line_is_told_with_its_rates_and_with_what_a_pulled_cable_means() -> None:
    found = findings(bus=LINE, cycle={"achieved_hz": 19.5})
    assert found["serial line"].verdict == "ok"
    assert "19.5 cycles a second" in found["serial line"].finding
    assert "7.5 at 38400 baud" in found["serial line"].finding
    assert "1.4 s and 1.5 m after it, a pair that is being turned 63 degrees" in found["pulled cable"].finding


def test_a_line_that_is_slower_than_planned_is_a_problem() -> None:
    found = findings(bus=LINE, cycle={"achieved_hz": 9.0})
    assert found["line rate"].verdict == "problem"
    assert "latency timer" in found["line rate"].mend


def test_a_node_that_is_silent_on_a_serial_line_is_a_problem() -> None:
    found = findings(bus={**LINE, "silent_nodes": [3]}, cycle={"achieved_hz": 10.0})
    assert (found["serial line"].verdict, "silent nodes: 3" in found["serial line"].finding) == ("problem", True)


def test_a_serial_line_that_is_gone_is_a_problem() -> None:
    found = findings(bus={**LINE, "line_down": "/dev/ttyUSB0 is gone"}, cycle={})
    assert (found["serial line"].verdict, found["serial line"].finding) == ("problem", "/dev/ttyUSB0 is gone")


@pytest.mark.parametrize("state", ["waiting", "booting"])
def test_the_rate_of_a_line_is_not_judged_while_nodes_are_configured_over_it(state: str) -> None:
    told = findings(state=state, bus={**LINE, "dropped_stale": 52}, cycle={"achieved_hz": 3.0})
    assert "problem" not in {finding.verdict for finding in told.values()}


def test_what_a_serial_line_drops_is_told_in_its_terms() -> None:
    found = findings({"bus": {"dropped_stale": 50}}, bus={**LINE, "dropped_stale": 52}, cycle={"achieved_hz": 17.0})
    assert (found["bus"].verdict, found["bus"].finding) == ("problem", "the line was too slow for 52 targets")
    assert "acknowledge" not in found["bus"].mend


def test_what_counters_counted_before_the_doctor_came_is_no_reason_for_exit_code_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    backend = FakeBackend()
    backend.cycle = {"cycles": 809, "late_cycles": 60}
    monkeypatch.setattr("daemon.cli.doctor.NETWORK_DEVICES", tmp_path)
    monkeypatch.setattr("daemon.cli.doctor.WATCHED_S", 0.05)
    with served(backend, tmp_path / "robot.sock") as server:
        assert main(["doctor", "--socket", str(server.path)]) == 0
    assert "60 of 809 control cycles were late" in capsys.readouterr().out
