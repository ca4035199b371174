"""The control station as a service: beside a robot's, on a port that is taken, and without tokens."""

from __future__ import annotations

import http.client
import json
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from vcan_tests.systemd.bench import WITHIN_S, Journal, Robot, tell, told, until

pytestmark = [pytest.mark.systemd, pytest.mark.timeout(240)]
STATION = "canhelm-station.service"
HERE = ("127.0.0.1", 8137)
TOKENS = Path("/etc/canhelm/station.tokens")
TOKEN = "0123456789abcdef" * 4
TAKEN = "the control station cannot listen on 127.0.0.1 port 8137: Address already in use"


@pytest.fixture
def tokens(dark_robot: Robot) -> Iterator[None]:
    """A token for who may drive, in the service's file; the service is at rest afterwards."""
    TOKENS.touch(mode=0o600)
    TOKENS.write_text(f"drive {TOKEN}\n")
    told("chown", "canhelm:", str(TOKENS))
    yield
    told("systemctl", "stop", STATION)
    tell("systemctl", "reset-failed")
    TOKENS.unlink()


def asked(method: str, path: str, body: str | None = None, **headers: str) -> tuple[http.client.HTTPResponse, Any]:
    """An answer of the station, and what it tells."""
    connection = http.client.HTTPConnection(*HERE, timeout=WITHIN_S)
    try:
        connection.request(method, path, body, headers)
        answer = connection.getresponse()
        return answer, json.load(answer)
    finally:
        connection.close()


def listens() -> bool:
    """Whether somebody listens on the station's port."""
    try:
        socket.create_connection(HERE, timeout=WITHIN_S).close()
    except ConnectionRefusedError:
        return False
    return True


@pytest.mark.usefixtures("tokens")
async def test_it_serves_the_robots_of_the_machine_to_who_has_a_token(dark_robot: Robot) -> None:
    await dark_robot.make_idle()
    told("systemctl", "start", STATION)
    await until(listens)
    assert asked("GET", "/robots")[0].status == 403
    answer, _ = asked("POST", "/login", json.dumps({"token": TOKEN}))
    cookie = str(answer.headers["Set-Cookie"]).partition(";")[0]
    assert asked("GET", "/robots", Cookie=cookie)[1] == {"robots": [{"name": "max2d", "alive": True}]}


@pytest.mark.usefixtures("tokens")
async def test_a_second_station_on_its_port_says_why_it_does_not_start() -> None:
    told("systemctl", "start", STATION)
    await until(listens)
    second = tell("canhelm", "station", "--tokens", str(TOKENS), user="canhelm")
    assert (second.returncode, second.stdout) == (7, "")
    assert f"{TAKEN} - choose another port with --port" in second.stderr


@pytest.mark.usefixtures("tokens")
async def test_a_port_that_is_taken_is_told_in_its_journal_and_not_tried_again(dark_robot: Robot) -> None:
    journal = Journal(STATION)
    with socket.create_server(HERE):
        tell("systemctl", "start", STATION)
        await until(lambda: dark_robot.show("ActiveState", STATION) == "failed")
    await journal.has(TAKEN)
    assert dark_robot.show("NRestarts", STATION) == "0"


async def test_without_a_file_of_tokens_it_ends_and_names_the_file(dark_robot: Robot) -> None:
    journal = Journal(STATION)
    tell("systemctl", "start", STATION)
    await until(lambda: dark_robot.show("ActiveState", STATION) == "failed")
    await journal.has(f"the tokens in {TOKENS} cannot be read: No such file or directory")
