"""The ``nxt.*`` methods that ask a brick; those that move the robot are the vehicle's."""

from __future__ import annotations

from typing import Any

from canhelm.errors import NodeAbsent, Refused
from daemon.runtime.handlers import Handler, Params
from daemon.runtime.supervisor import Supervisor
from drivers.nxt import replies, requests
from drivers.nxt.brick import Brick


class BrickCommands:
    """Handlers, by name in :attr:`handlers`.

    Args:
        supervisor: for the bricks.
    """

    def __init__(self, supervisor: Supervisor) -> None:
        self._bricks = supervisor.devices.bricks
        self.handlers: dict[str, Handler] = {"nxt.battery": self._battery, "nxt.info": self._info}

    def _brick(self, params: Params) -> tuple[str, Brick]:
        """The brick that is meant. Raises Refused where there is none, NodeAbsent where there is no such one."""
        if not self._bricks:
            raise Refused("this robot has no NXT brick", remedy="add `bricks:` to its profile")
        given, have = params.get("brick"), ", ".join(self._bricks)
        if not given and len(self._bricks) > 1:
            raise NodeAbsent("which brick? this robot has several", remedy=f"give one of {have}")
        name = given or next(iter(self._bricks))
        if name not in self._bricks:
            raise NodeAbsent(f"this robot has no brick {name!r}", remedy=f"give one of {have}, or none")
        return name, self._bricks[name]

    async def _battery(self, params: Params, lease: str | None) -> dict[str, Any]:
        name, brick = self._brick(params)
        voltage = await brick.read_battery()
        refused = voltage < brick.settings.refuse_v
        return {"brick": name, "battery_v": voltage, "low": brick.battery_low, "refused": refused}

    async def _info(self, params: Params, lease: str | None) -> dict[str, Any]:
        name, brick = self._brick(params)
        info, firmware = await brick.ask(requests.GetDeviceInfo()), await brick.ask(requests.GetFirmwareVersion())
        sleep = await brick.ask(requests.KeepAlive())
        assert isinstance(info, replies.DeviceInfo)
        assert isinstance(firmware, replies.FirmwareVersion)
        assert isinstance(sleep, replies.SleepLimit)
        return {
            "brick": name,
            "name": info.name,
            "address": info.address,
            "firmware": f"{firmware.firmware_major}.{firmware.firmware_minor:02d}",
            "protocol": f"{firmware.protocol_major}.{firmware.protocol_minor}",
            "free_flash_bytes": info.free_flash,
            "sleep_limit_s": sleep.sleep_limit_ms / 1000,
            "state": brick.status_sentence,
        }
