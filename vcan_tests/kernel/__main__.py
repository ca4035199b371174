"""``python -m vcan_tests.kernel [--systemd] [--timeout S] -- CMD ARG...``: runs a command in a guest with a CAN bus."""

from __future__ import annotations

import argparse
import sys

from vcan_tests.kernel.errors import MissingTool
from vcan_tests.kernel.guest import NO_STATUS, TIMED_OUT, exchange_folder, run_in_guest
from vcan_tests.kernel.processes import run
from vcan_tests.kernel.tools import require_tools


def main() -> int:
    """The command's own exit status; 124 when it was ended by the time-out, 125 when there was no guest to tell."""
    parser = argparse.ArgumentParser(prog="python -m vcan_tests.kernel", description=__doc__)
    parser.add_argument("--systemd", action="store_true", help="boot a real systemd; writing goes into a RAM disk")
    parser.add_argument("--timeout", type=float, metavar="S", help="end the guest after so many seconds")
    parser.add_argument("--show-kernel", action="store_true", help="show the kernel's own messages")
    parser.add_argument(
        "--env", action="append", default=[], metavar="K=V", type=variable, help="a variable for the command"
    )
    parser.add_argument("command", nargs="+", metavar="CMD ARG...")
    asked = parser.parse_args()
    try:
        require_tools()
        with exchange_folder() as exchange:
            work = run_in_guest(
                asked.command,
                exchange,
                systemd=asked.systemd,
                timeout_s=asked.timeout,
                show_kernel=asked.show_kernel,
                environment=dict(asked.env),
            )
            outcome = run(work)
    except MissingTool as error:
        print(f"no guest: {error}", file=sys.stderr)
        return NO_STATUS
    if outcome.status == TIMED_OUT:
        print(f"the guest was ended after {asked.timeout:g} s", file=sys.stderr)
    if outcome.status == NO_STATUS:
        print("the guest died before its command ended; --show-kernel tells more", file=sys.stderr)
    return outcome.status


def variable(text: str) -> tuple[str, str]:
    """Name and value from ``K=V``."""
    name, equals, value = text.partition("=")
    if not equals:
        raise argparse.ArgumentTypeError(f"{text}: want K=V")
    return name, value


if __name__ == "__main__":
    sys.exit(main())
