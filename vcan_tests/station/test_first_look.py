"""What somebody sees who comes to the station: no robot, a wrong name, a login, and what they may do then."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from vcan_tests.station.accessibility import findings
from vcan_tests.station.browser import CONNECTED, PANELS, PHONE, Operator
from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import Fleet, Station
from vcan_tests.station.test_doors import TOKENS
from vcan_tests.station.test_reasons import untold

pytestmark = pytest.mark.station


def station_with(fleet: Fleet, name: str, *options: str) -> Iterator[Station]:
    """One more station before the same robots."""
    station = Station(fleet.folder, options, name)
    yield station
    station.end()


@pytest.fixture(scope="module")
def lonely(fleet: Fleet) -> Iterator[Station]:
    """A station that offers only a robot that nobody has started."""
    yield from station_with(fleet, "lonely", "--robot", "nosuch")


@pytest.fixture(scope="module")
def guarded(fleet: Fleet) -> Iterator[Station]:
    """A station that wants tokens."""
    tokens = fleet.folder / "look.tokens"
    tokens.touch(mode=0o600)
    tokens.write_text("".join(f"{role} {token}\n" for role, token in TOKENS.items()))
    yield from station_with(fleet, "look", "--tokens", str(tokens))


def test_a_robot_that_was_never_started_is_said_to_be_absent_with_the_command_that_starts_it(
    meet: Meet, lonely: Station
) -> None:
    operator = meet(lonely.url)
    operator.open()
    operator.sees("#absent", "No word from nosuch")
    operator.sees("#absent", "canhelm run --profile nosuch .*systemctl start canhelm@nosuch")
    operator.comes_to(lambda: operator.page.is_hidden("#panels"), True)
    assert findings(operator.page) == []


def test_a_wrong_name_in_the_address_is_told_with_the_robots_that_run(meet: Meet, fleet: Fleet) -> None:
    operator = meet(f"{fleet.station.url}?robot=nope")
    operator.open()
    operator.sees("#absent", "No word from nope")
    operator.page.click("#absent button:has-text('max2d')")
    operator.sees("#connection", CONNECTED)
    operator.comes_to(lambda: operator.page.is_hidden("#absent"), True)


def test_without_any_robot_the_page_says_how_to_start_one(meet: Meet, fleet: Fleet) -> None:
    operator = meet()
    operator.page.route(
        "**/robots", lambda route: route.fulfill(body='{"robots": []}', content_type="application/json")
    )
    operator.open()
    operator.sees("#absent", "No robot runs on this machine")
    operator.sees("#absent", "canhelm run --simulate --profile max2d")
    assert findings(operator.page) == []


def log_in(meet: Meet, station: Station, token: str, **options: Any) -> Operator:
    """Somebody who has pasted this where a token belongs."""
    operator = meet(station.url, **options)
    operator.open()
    operator.page.fill("#token", token)
    operator.page.click("#login button")
    return operator


def test_a_whole_line_of_the_tokens_file_logs_in(meet: Meet, guarded: Station) -> None:
    log_in(meet, guarded, f"  drive {TOKENS['drive']}\n").sees("#connection", CONNECTED)


@pytest.mark.parametrize(
    ("token", "words"),
    [("  ", "paste the token first"), ("x" * 5000, "5000 characters"), ("two words", "has no spaces")],
)
def test_what_cannot_be_a_token_is_told_in_words(meet: Meet, guarded: Station, token: str, words: str) -> None:
    log_in(meet, guarded, token).sees("#login", words)


@pytest.mark.parametrize(
    ("role", "words"), [("watch", "watching"), ("drive", "may drive"), ("configure", "may configure")]
)
def test_the_page_shows_its_role_and_the_way_out(meet: Meet, guarded: Station, role: str, words: str) -> None:
    operator = log_in(meet, guarded, TOKENS[role])
    operator.sees("#who", f": {words}$")
    operator.page.click("#logout")
    operator.page.wait_for_selector("#login input")


def test_a_person_who_may_only_watch_reads_why_nothing_can_be_done(meet: Meet, guarded: Station) -> None:
    operator = log_in(meet, guarded, TOKENS["watch"], **PHONE)
    operator.sees("#who", "watching")
    assert untold(operator) == {panel: [] for panel in PANELS}
