"""Reads a robot's state: once at a glance, then ten samples of its drives a tenth of a second apart.

Start a daemon first (`canhelm run --simulate --profile max2d`), then `python examples/read_state.py`.
"""

import itertools
import os
import sys

from canhelm.client import Client
from canhelm.errors import CanhelmError


def main() -> None:
    """Print the state; nothing is moved."""
    with Client() as robot:
        status = robot.status()
        print(f"robot {status['robot']}: {status['state']}")
        for node in status["nodes"]:
            print(f"node {node['node']} {node['name']}: {node['node_state']}")
        samples = (status for method, status in robot.notifications(rate_hz=10) if method == "status")
        for status in itertools.islice(samples, 10):
            speeds = [f"{node['speed_m_s']:.3f}" for node in status["nodes"] if "speed_m_s" in node]
            print(f"{status['time_s']:.1f} s  wheels {' '.join(speeds)} m/s", flush=True)


if __name__ == "__main__":
    try:
        main()
    except BrokenPipeError:  # whoever reads the output has seen enough, as `head` has
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except CanhelmError as error:
        sys.exit(str(error))
