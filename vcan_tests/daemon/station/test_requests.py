"""Messages of a page: taken apart, and made into single lines."""

from __future__ import annotations

import contextlib
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm import protocol
from canhelm.errors import UsageError
from daemon.station.requests import make_line, parse_request

VALUES = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
)


@given(st.text() | VALUES.map(json.dumps))
def test_no_message_does_more_than_be_refused(text: str) -> None:
    with contextlib.suppress(UsageError):
        parse_request(text)


@given(st.dictionaries(st.text(), VALUES), st.integers(1, 8))
def test_a_request_becomes_one_line_however_its_page_wrote_it(params: dict[str, object], indent: int) -> None:
    try:
        request = parse_request(json.dumps({"method": "status", "id": 1, "params": params}, indent=indent))
    except UsageError:  # NaN and infinity are no JSON
        return
    line = make_line(request)
    assert line.count(b"\n") == 1
    assert protocol.parse_message(line) == request


def test_a_request_that_grows_beyond_a_line_is_refused() -> None:
    request = {"method": "status", "x": "\u00e9" * (protocol.MAX_REQUEST_BYTES // 4)}
    with pytest.raises(UsageError, match="longer than"):
        make_line(request)
