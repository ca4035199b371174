"""Who gets in: tokens, roles, foreign pages, foreign names."""

from __future__ import annotations

import http.client
import json
import threading
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import pytest

from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import Fleet, Robot, Station, at_rest

pytestmark = pytest.mark.station

TOKENS = {role: f"{role}-" + "0123456789abcdef" * 2 for role in ("watch", "drive", "configure")}
UPGRADE = {
    "Connection": "Upgrade",
    "Upgrade": "websocket",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
}
ASK = """async ([path, request]) => {
    const socket = new WebSocket(`ws://${location.host}${path}`);
    await new Promise((done, failed) => { socket.onopen = done; socket.onerror = failed; });
    const answer = new Promise(done => socket.addEventListener("message", event => {
        const message = JSON.parse(event.data);
        if (message.id === request.id) done(message);
    }));
    socket.send(JSON.stringify(request));
    const told = await answer;
    socket.close();
    return told;
}"""
"""Sends one request as a forged page would, and tells the answer."""


@pytest.fixture(scope="module")
def guarded(fleet: Fleet) -> Iterator[Station]:
    """A second station before the same robots, which wants tokens."""
    tokens = fleet.folder / "station.tokens"
    tokens.touch(mode=0o600)
    tokens.write_text("".join(f"{role} {token}\n" for role, token in TOKENS.items()))
    station = Station(fleet.folder, ("--tokens", str(tokens)), "guarded")
    yield station
    station.end()


def answered(station: Station, method: str, path: str, body: str | None = None, **headers: str) -> tuple[int, str]:
    """Status and text of an answer, with headers as anybody may send them."""
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    connection = http.client.HTTPConnection("127.0.0.1", station.port, timeout=10.0)
    try:
        connection.request(method, path, body, named)
        answer = connection.getresponse()
        return answer.status, answer.read(65_536).decode() if answer.status != 101 else ""
    finally:
        connection.close()


@pytest.mark.parametrize("path", ["/", "/page/style.css", "/session", "/robots", "/ws/max2d"])
def test_a_foreign_name_for_the_station_is_refused(fleet: Fleet, path: str) -> None:
    assert answered(fleet.station, "GET", path, Host="robots.example:80", **UPGRADE)[0] == 403


@pytest.mark.parametrize("origin", ["http://robots.example", "http://127.0.0.1:1", "https://127.0.0.1", "null"])
def test_a_foreign_origin_gets_no_connection_to_a_robot(fleet: Fleet, origin: str) -> None:
    assert answered(fleet.station, "GET", "/ws/max2d", Origin=origin, **UPGRADE)[0] == 403


def test_the_own_origin_gets_one(fleet: Fleet) -> None:
    assert answered(fleet.station, "GET", "/ws/max2d", Origin=fleet.station.url.rstrip("/"), **UPGRADE)[0] == 101


def test_nothing_outside_of_the_page_is_served(fleet: Fleet) -> None:
    for path in ("/page/../tokens.py", "/page/%2e%2e/server.py", "/page//etc/passwd", "/page/..%2f..%2fapp.py"):
        status, text = answered(fleet.station, "GET", path)
        assert (path, status) == (path, 404)
        assert "import" not in text


def test_without_a_session_there_is_no_robot(guarded: Station) -> None:
    assert answered(guarded, "GET", "/robots")[0] in (401, 403)
    assert answered(guarded, "GET", "/ws/max2d", Origin=guarded.url.rstrip("/"), **UPGRADE)[0] in (401, 403)
    assert answered(guarded, "GET", "/runs/max2d/x/y")[0] in (401, 403)


def test_a_wrong_token_is_refused_after_a_second_and_says_what_to_do(guarded: Station) -> None:
    begun_s = time.monotonic()
    body = json.dumps({"token": "x" * 40})
    status, text = answered(guarded, "POST", "/login", body, Content_Type="application/json")
    assert status == 403
    assert time.monotonic() - begun_s >= 0.9
    assert json.loads(text)["remedy"]


def test_a_station_without_tokens_listens_on_no_other_address(fleet: Fleet) -> None:
    station = fleet.folder / "open.log"
    with pytest.raises(AssertionError, match="token"):
        Station(fleet.folder, ("--host", "0.0.0.0"), station.stem)


class ForeignPage(BaseHTTPRequestHandler):
    """An empty page of somebody else."""

    def do_GET(self) -> None:
        """Any path."""
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(b"<!doctype html><link rel=icon href=data:,><title>elsewhere</title>")

    def log_message(self, format: str, *args: Any) -> None:
        """Nobody wants to know."""


@pytest.fixture
def elsewhere() -> Iterator[str]:
    """The address of a page that is none of the station's."""
    server = HTTPServer(("127.0.0.1", 0), ForeignPage)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    thread.join()
    server.server_close()


TRESPASS = """async host => {
    const socket = new WebSocket(`ws://${host}/ws/max2d`);
    const opened = await new Promise(done => {
        socket.onopen = () => done("open"); socket.onerror = () => done("refused");
    });
    const read = await fetch(`http://${host}/robots`).then(() => "read", () => "refused");
    const frame = document.createElement("iframe");
    frame.src = `http://${host}/`;
    const framed = new Promise(done => { frame.onload = done; });
    document.body.append(frame);
    await framed;
    let inside = "shown";
    try { inside = frame.contentDocument ? "read" : "shown"; } catch { inside = "shown"; }
    return [opened, read, inside];
}"""


def test_a_foreign_page_in_the_same_browser_gets_nothing(meet: Meet, fleet: Fleet, elsewhere: str) -> None:
    operator = meet(elsewhere)
    operator.expects("403", "CORS", "WebSocket", "frame", "leaves the station", "failed: ", "ERR_FAILED")
    operator.open()
    host = fleet.station.url.removeprefix("http://").rstrip("/")
    assert operator.page.evaluate(TRESPASS, host)[:2] == ["refused", "refused"]
    operator.until(
        lambda: any("frame-ancestors" in problem for problem in operator.problems), lambda: str(operator.problems)
    )


def log_in(meet: Meet, station: Station, token: str) -> Any:
    """Somebody who has typed a token."""
    operator = meet(station.url)
    operator.open()
    operator.page.fill("#login input", token)
    operator.page.click("#login button")
    return operator


def test_a_wrong_token_is_told_on_the_page(meet: Meet, guarded: Station) -> None:
    operator = log_in(meet, guarded, "wrong" * 8)
    operator.expects("403")
    operator.sees("#login [role=alert]", "the token is wrong: give one of")
    operator.comes_to(lambda: operator.page.is_enabled("#login button"), True)


def test_a_watcher_sees_the_robot_and_is_told_why_nothing_can_be_pressed(
    meet: Meet, guarded: Station, robot: Robot
) -> None:
    operator = log_in(meet, guarded, TOKENS["watch"])
    operator.choose("max2d")
    operator.sees("#state", "idle")
    operator.go_to("drive")
    operator.comes_to(lambda: operator.page.is_disabled("#reset"), True)
    operator.sees("#why-drive", "needs the role drive, and this page has watch")


@pytest.mark.parametrize(
    ("method", "params"),
    [
        ("drive.set", {"speed_m_s": 0.3}),
        ("reset", {}),
        ("simulation.fault", {"kind": "ice", "part": "front_left"}),
        ("sdo.write", {"node": 1, "object": "0x6081", "value": 100}),
        ("station.path.write", {"name": "x", "path": {"pieces": []}, "replace": False}),
    ],
)
def test_a_forged_request_of_a_watcher_is_refused_by_the_station(
    meet: Meet, guarded: Station, robot: Robot, method: str, params: dict[str, Any]
) -> None:
    operator = log_in(meet, guarded, TOKENS["watch"])
    operator.choose("max2d")
    request = {"jsonrpc": "2.0", "id": 77, "method": method, "params": params}
    answer = operator.page.evaluate(ASK, ["/ws/max2d", request])
    assert answer["error"]["data"]["type"] == "PermissionRefused"
    assert answer["error"]["data"]["remedy"]
    assert at_rest(robot.status())


def test_a_watcher_may_stop_the_robot(meet: Meet, guarded: Station, robot: Robot, expected_errors: list[str]) -> None:
    expected_errors.append("emergency stop")
    operator = log_in(meet, guarded, TOKENS["watch"])
    operator.choose("max2d")
    request = {"jsonrpc": "2.0", "id": 78, "method": "estop", "params": {}}
    assert "result" in operator.page.evaluate(ASK, ["/ws/max2d", request])
    assert robot.status()["state"] == "estop"


def test_who_drives_writes_no_objects(meet: Meet, guarded: Station) -> None:
    operator = log_in(meet, guarded, TOKENS["drive"])
    operator.choose("max2d")
    request = {"jsonrpc": "2.0", "id": 79, "method": "sdo.write", "params": {"node": 1, "object": "0x6081", "value": 9}}
    answer = operator.page.evaluate(ASK, ["/ws/max2d", request])
    assert answer["error"]["data"]["type"] == "PermissionRefused"


def test_the_session_cookie_is_kept_from_scripts_and_other_sites(meet: Meet, guarded: Station) -> None:
    operator = log_in(meet, guarded, TOKENS["drive"])
    operator.choose("max2d")
    (cookie,) = operator.context.cookies()
    assert (cookie["httpOnly"], cookie["sameSite"]) == (True, "Strict")
    assert TOKENS["drive"] not in cookie["value"]
    assert TOKENS["drive"] not in Path(guarded.log).read_text()
