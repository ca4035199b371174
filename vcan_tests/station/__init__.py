"""End-to-end tests of the control station: real daemons, a real station, a real browser (``make station-test``)."""
