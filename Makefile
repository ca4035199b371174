# canhelm: `make demo` on a fresh machine drives the simulated robot, `make test` proves the code.
# Needs python3 (3.11 or later, with its venv module) and make.

PYTHON ?= python3
VENV := .venv
PIP := $(VENV)/bin/python -m pip install --quiet --disable-pip-version-check
OUT ?= demo-out
MINUTES ?= 10
SERVICE_PYTHON ?= /usr/bin/python3
PREFIX ?= /opt/canhelm
PACKAGED = $(shell find canhelm daemon drivers profiles packaging systemd -type f ! -name '*.py[co]') \
	$(wildcard docs/*.md) pyproject.toml README.md CHANGELOG.md LICENSE
PACKAGING = DESTDIR='$(DESTDIR)' PREFIX='$(PREFIX)' PYTHON='$(SERVICE_PYTHON)' PIP_PYTHON='$(VENV)/bin/python'

.DEFAULT_GOAL := help
.PHONY: help venv demo docs test lint bench fuzz long-life vcan-test vcan-figures station-test station-pictures \
	station-figures install uninstall deb client-wheel

help: ## this list
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' $(MAKEFILE_LIST)

venv: $(VENV)/.stamp-demo ## canhelm in .venv

demo: $(VENV)/.stamp-demo ## the simulated robot drives the published manoeuvres; pictures into demo-out/
	$(VENV)/bin/canhelm demo --out $(OUT)

docs: $(VENV)/.stamp-docs ## the documentation as a site of files, into site/; a warning is an error
	$(VENV)/bin/python -m daemon.reference pages docs/reference
	$(VENV)/bin/sphinx-build -W --keep-going -q docs site
	@echo "open site/index.html"

test: lint ## style, types, import rules, then all tests
	$(VENV)/bin/pytest -n auto --dist loadfile -m 'not real_time and not vcan and not systemd and not station'
	$(VENV)/bin/pytest -m 'real_time and not vcan and not systemd and not station'

fuzz: $(VENV)/.stamp-test ## any input to every reader and every wire: MINUTES=10 for each target, or TARGET=NAME alone
	$(VENV)/bin/python -m vcan_tests.fuzz --minutes $(MINUTES) $(TARGET)

long-life: $(VENV)/.stamp-test ## 12 virtual hours among people, programs and faults, in about one; figures into long-life-out/
	$(VENV)/bin/python -m vcan_tests.long_life $(ARGS)

bench: $(VENV)/.stamp-bench ## what canhelm costs and how fast it is here, into bench-out/; ARGS='--vcan' or ARGS='PART ...'
	$(VENV)/bin/python -m benchmarks $(ARGS)

vcan-test: $(VENV)/.stamp-test ## the tests on a kernel's CAN bus and under a real systemd, both booted if need be
	$(VENV)/bin/python -m vcan_tests.kernel.suite $(ARGS)

vcan-figures: $(VENV)/.stamp-test ## measure there: stops without a daemon, period of SYNC, what tshark says, a life of the service
	$(VENV)/bin/python -m vcan_tests.vcan.figures
	$(VENV)/bin/python -m vcan_tests.systemd.figures

station-test: $(VENV)/.stamp-station ## the control station in a headless Chromium, before simulated robots
	$(VENV)/bin/python -m vcan_tests.station.suite $(ARGS)

station-pictures: $(VENV)/.stamp-station ## its panels at a desktop and on a phone, into docs/images/station
	$(VENV)/bin/python -m vcan_tests.station.suite --pictures docs/images/station $(ARGS)

station-figures: $(VENV)/.stamp-station ## what it costs, and how soon a stop is on the bus; MINUTES=30 of an open page
	$(VENV)/bin/python -m vcan_tests.station.figures --minutes $(MINUTES) $(ARGS)

install: | $(VENV)/bin/pip ## the service on this machine (as root): /opt/canhelm, units, users; see docs/service.md
	$(PACKAGING) packaging/install.sh

uninstall: ## take it away again; profiles, logs and state stay
	$(PACKAGING) packaging/uninstall.sh

deb: dist/.stamp-deb ## the service as a Debian package, into dist/

client-wheel: | $(VENV)/bin/pip ## the client for programs in environments of their own, into dist/
	$(VENV)/bin/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir dist packaging/client

lint: $(VENV)/.stamp-test ## style, types and import rules
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy
	$(VENV)/bin/lint-imports

dist/.stamp-deb: $(PACKAGED) | $(VENV)/bin/pip
	$(PACKAGING) packaging/deb.sh
	@touch $@

$(VENV)/bin/pip:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "canhelm needs Python 3.11 or later: make PYTHON=/path/to/python3.11 venv" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip' 2>/dev/null \
		|| { echo "Python's venv module is missing; install it with: apt install python3-venv" >&2; exit 1; }
	@echo "creating $(VENV)"
	@$(PYTHON) -m venv $(VENV)

$(VENV)/.stamp-demo: pyproject.toml | $(VENV)/bin/pip
	@echo "installing canhelm and what its pictures and its control station need into $(VENV)"
	@$(PIP) --editable '.[plot,web]'
	@touch $@

$(VENV)/.stamp-test: pyproject.toml | $(VENV)/bin/pip
	@echo "installing canhelm and what its tests need into $(VENV)"
	@$(PIP) --editable '.[plot,test]'
	@touch $@

$(VENV)/.stamp-station: pyproject.toml | $(VENV)/bin/pip
	@echo "installing canhelm, its station and what the station's tests need into $(VENV)"
	@$(PIP) --editable '.[station]'
	@touch $@

$(VENV)/.stamp-bench: pyproject.toml | $(VENV)/bin/pip
	@echo "installing canhelm and what its benchmark needs into $(VENV)"
	@$(PIP) --editable '.[bench]'
	@touch $@

$(VENV)/.stamp-docs: pyproject.toml | $(VENV)/bin/pip
	@echo "installing canhelm and what its documentation needs into $(VENV)"
	@$(PIP) --editable '.[docs]'
	@touch $@
