"""A stand-in for ROS 2: runs a program that imports ``rclpy`` and messages, sends it twists, prints what it publishes.

Called as ``python -m vcan_tests.fake_ros PROGRAM``; its input is lines of ``SECONDS X Y YAW_RATE``: a twist that comes
twenty times a second for that long. After the last one the program goes on for a while, then its context ends.
"""

from __future__ import annotations

import json
import runpy
import sys
import threading
import time
from collections.abc import Callable, Iterator
from types import ModuleType, SimpleNamespace
from typing import Any

PERIOD_S = 0.05
SILENCE_S = 2.0
"""How long the program goes on without twists."""
MESSAGES = {
    "geometry_msgs.msg": ("Twist",),
    "nav_msgs.msg": ("Odometry",),
    "diagnostic_msgs.msg": ("DiagnosticArray", "DiagnosticStatus"),
}


class Message(SimpleNamespace):
    """Any message: what is asked of it and not there yet is a message, too."""

    OK, WARN, ERROR = b"\0", b"\1", b"\2"

    def __getattr__(self, name: str) -> Message:
        if name.startswith("_"):
            raise AttributeError(name)
        part = Message()
        setattr(self, name, part)
        return part


class Node:
    """Publishers that print, and subscriptions that twists are sent to."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.callbacks: dict[str, Callable[[Message], None]] = {}

    def create_publisher(self, kind: type, topic: str, depth: int) -> SimpleNamespace:
        """It prints one JSON object a message."""
        return SimpleNamespace(publish=lambda message: _print({"topic": topic, "message": message}))

    def create_subscription(self, kind: type, topic: str, callback: Callable[[Message], None], depth: int) -> None:
        """From now on the callback is told."""
        self.callbacks[topic] = callback

    def get_logger(self) -> SimpleNamespace:
        """It prints, too."""
        return SimpleNamespace(warning=lambda text: _print({"warning": text}))

    def get_clock(self) -> SimpleNamespace:
        """Wall-clock time."""
        stamp = Message(sec=int(time.time()), nanosec=0)
        return SimpleNamespace(now=lambda: SimpleNamespace(to_msg=lambda: stamp))


def _print(value: dict[str, Any]) -> None:
    print(json.dumps(value, default=lambda part: vars(part) if isinstance(part, Message) else part.hex()), flush=True)


class Script:
    """The twists that come, one a turn."""

    def __init__(self, lines: Iterator[str]) -> None:
        self._twists = [
            Message(linear=Message(x=x, y=y), angular=Message(z=rate))
            for seconds, x, y, rate in (map(float, line.split()) for line in lines)
            for _ in range(round(seconds / PERIOD_S))
        ]
        self._turns = len(self._twists) + round(SILENCE_S / PERIOD_S)
        self._turn = 0

    def ok(self) -> bool:
        """Whether it goes on."""
        return self._turn < self._turns

    def spin_once(self, node: Node, timeout_sec: float) -> None:
        """Wait for the next turn, and send its twist, if there is one."""
        threading.Event().wait(timeout_sec)
        if self._turn < len(self._twists):
            node.callbacks["cmd_vel"](self._twists[self._turn])
        self._turn += 1


def main() -> None:
    """Run the program as if ROS 2 were there."""
    script = Script(iter(sys.stdin))
    rclpy = ModuleType("rclpy")
    vars(rclpy).update(init=lambda: None, create_node=Node, ok=script.ok, spin_once=script.spin_once)
    sys.modules["rclpy"] = rclpy
    for name, kinds in MESSAGES.items():
        module = sys.modules[name] = ModuleType(name)
        vars(module).update(dict.fromkeys(kinds, Message))
        sys.modules[name.partition(".")[0]] = module
    runpy.run_path(sys.argv[1], run_name="__main__")


if __name__ == "__main__":
    main()
