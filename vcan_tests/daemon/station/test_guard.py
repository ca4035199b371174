"""Which requests are looked at: none of a foreign page, none by a foreign name."""

from __future__ import annotations

import json
import logging
import re
import time

import pytest
from aiohttp import WSServerHandshakeError
from hypothesis import given
from hypothesis import strategies as st

from daemon.api.parameters import Role
from daemon.station.guard import Guard
from vcan_tests.daemon.station.conftest import TOKENS
from vcan_tests.daemon.station.visitor import Visitor

pytestmark = pytest.mark.real_time


@pytest.mark.parametrize("path", ["/", "/page/main.js", "/session", "/robots", "/ws/fake", "/runs/fake/1/plot"])
@pytest.mark.parametrize("host", ["robots.example", "127.0.0.1.robots.example:80", "10.0.0.1", "[::2]:80", "[", ""])
async def test_a_request_by_a_foreign_name_is_refused(visitor: Visitor, path: str, host: str) -> None:
    answer = await visitor.get(path, Host=host)
    assert answer.status == 403
    assert (await answer.json())["remedy"]


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1:9000", "[::1]:8137", "LOCALHOST:1"])
async def test_a_forwarded_port_keeps_the_names_of_this_machine(visitor: Visitor, host: str) -> None:
    assert (await visitor.get("/session", Host=host)).status == 200


@pytest.mark.parametrize("origin", ["http://robots.example", "null", "https://127.0.0.1", "http://127.0.0.1:1"])
async def test_a_foreign_origin_is_refused(visitor: Visitor, origin: str) -> None:
    with pytest.raises(WSServerHandshakeError) as caught:
        await visitor.open(Origin=origin)
    assert caught.value.status == 403


async def test_the_own_origin_is_connected(visitor: Visitor) -> None:
    page = await visitor.open(Origin=visitor.url)
    assert (await page.ask("hello"))["result"]["robot"] == "fake"


async def test_another_site_has_nothing_loaded_from_here(visitor: Visitor) -> None:
    answer = await visitor.get("/runs/fake/1/plot", Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="no-cors")
    assert answer.status == 403


async def test_a_link_on_another_site_opens_the_page(visitor: Visitor) -> None:
    answer = await visitor.get("/", Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="navigate")
    assert answer.status == 200


@pytest.mark.parametrize("path", ["/", "/page/main.js", "/session", "/nothing"])
async def test_every_answer_forbids_what_comes_from_elsewhere(visitor: Visitor, path: str) -> None:
    headers = (await visitor.get(path)).headers
    assert headers["Content-Security-Policy"].startswith("default-src 'self';")
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    assert (headers["X-Content-Type-Options"], headers["Referrer-Policy"]) == ("nosniff", "no-referrer")


@pytest.mark.parametrize(
    "path", ["/page/..%2fserver.py", "/page/%2e%2e%2fserver.py", "/page//etc/passwd", "/page/x.js"]
)
async def test_nothing_but_the_page_is_served(visitor: Visitor, path: str) -> None:
    answer = await visitor.get(path)
    assert answer.status == 404
    assert (await answer.json())["message"]


async def test_the_page_and_its_modules_are_served_as_what_they_are(visitor: Visitor) -> None:
    assert (await visitor.get("/")).content_type == "text/html"
    assert "javascript" in (await visitor.get("/page/main.js")).content_type


@given(st.from_regex(r"[a-z0-9.:@/\[\]\\?#-]*(localhost|127\.0\.0\.1|\[::1\])[a-z0-9.:@/\[\]\\?#-]*", fullmatch=True))
def test_no_name_that_merely_looks_like_this_machine_is_taken_for_it(host: str) -> None:
    if Guard("127.0.0.1").is_here(host):
        assert re.fullmatch(r"(localhost\.?|127(\.\d{1,3}){3}\.?|\[::1\])(:\d{1,5})?", host)


def test_a_station_in_the_network_answers_to_its_addresses_and_names() -> None:
    guard = Guard("lab1.example")
    assert [guard.is_here(host) for host in ("lab1.example:8137", "192.168.1.7", "[fe80::1]:80", "localhost")] == [
        True
    ] * 4
    assert not guard.is_here("robots.example")


@pytest.mark.parametrize("path", ["/robots", "/ws/fake", "/runs/fake/1/plot", "/runs/fake/1/cycles.csv"])
async def test_without_a_token_there_is_no_robot(guest: Visitor, path: str) -> None:
    answer = await guest.get(path)
    assert answer.status == 403
    assert "token" in (await answer.json())["message"]


async def test_a_session_tells_its_role(guest: Visitor) -> None:
    before = await (await guest.get("/session")).json()
    await guest.login(TOKENS[Role.WATCH])
    after = await (await guest.get("/session")).json()
    assert (before["login_needed"], before["role"], after["role"]) == (True, None, "watch")


async def test_a_cookie_is_out_of_reach_of_scripts_and_other_sites(guest: Visitor) -> None:
    cookie = (await guest.login(TOKENS[Role.DRIVE])).headers["Set-Cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    assert TOKENS[Role.DRIVE] not in cookie


async def test_a_wrong_token_is_told_after_a_second_and_logged_with_its_host_alone(
    guest: Visitor, caplog: pytest.LogCaptureFixture
) -> None:
    begun_s = time.monotonic()
    answer = await guest.login("x" * 40)
    assert time.monotonic() - begun_s >= 0.99
    assert answer.status == 403
    assert await answer.json() == {"message": "the token is wrong", "remedy": "give one of the station's --tokens file"}
    told = [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING]
    assert told == ["somebody at 127.0.0.1 showed a wrong token"]


@pytest.mark.parametrize("body", ["", "{", "[]", '{"token": 3}', "{" * 4000, "\0"])
async def test_a_login_that_is_none_is_refused(guest: Visitor, body: str) -> None:
    answer = await guest.session.post(f"{guest.url}/login", data=body.encode())
    assert answer.status == 400


async def test_a_login_that_is_too_long_is_refused(guest: Visitor) -> None:
    answer = await guest.session.post(f"{guest.url}/login", data=json.dumps({"token": "x" * 100_000}))
    assert answer.status == 413


async def test_who_logs_out_loses_the_robot_at_once(guest: Visitor) -> None:
    await guest.login(TOKENS[Role.DRIVE])
    page = await guest.open()
    await guest.session.post(f"{guest.url}/logout")
    assert await page.closed() == (1001, "logged out")
    assert (await guest.get("/robots")).status == 403
