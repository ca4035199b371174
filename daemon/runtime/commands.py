"""Commands: each method that makes something happen, from its validated parameters to the supervisor."""

from __future__ import annotations

from typing import Any

from canhelm.errors import Interlock, Refused
from daemon.runtime.brake_commands import BrakeCommands
from daemon.runtime.brick_commands import BrickCommands
from daemon.runtime.config_commands import ConfigCommands
from daemon.runtime.encoder_commands import EncoderCommands
from daemon.runtime.fault_commands import FaultCommands
from daemon.runtime.frame_commands import FrameCommands
from daemon.runtime.gamepad_commands import GamepadCommands
from daemon.runtime.handlers import Handler, Params, holder, run_motion
from daemon.runtime.look_commands import LookCommands
from daemon.runtime.motions import Motion
from daemon.runtime.motor_commands import MotorCommands
from daemon.runtime.network_commands import NetworkCommands
from daemon.runtime.node_commands import NodeCommands
from daemon.runtime.path_commands import PathCommands, PathVehicle
from daemon.runtime.setup_commands import SetupCommands
from daemon.runtime.simulation_commands import Network, SimulationCommands
from daemon.runtime.supervisor import Supervisor
from daemon.runtime.workshop_commands import Workshop, WorkshopCommands
from drivers.contract import DriveState
from drivers.simulated.computer_trouble import ComputerTrouble
from drivers.simulated.faults import Faults

REASON_LENGTH = 200
"""Characters of the reason for a stop that are kept."""
OF_A_SETUP = ("motor.enable", "motor.reset", "brake.release")
"""Methods without a motion that, while a setup is under way, are for its client alone."""


class Commands:
    """The methods of the API that command something, by name in :attr:`handlers`.

    Args:
        supervisor: what decides.
        network: the simulated network; None where it is real.
        workshop: where the simulated robot stands; None where it is real.
        faults: of the simulated network; None where it is real.
        trouble: what they make of its computer.

    Attributes:
        handlers: methods by name.
        paths: those that follow paths; None where the vehicle does not.
    """

    def __init__(
        self,
        supervisor: Supervisor,
        network: Network | None = None,
        workshop: Workshop | None = None,
        faults: Faults | None = None,
        trouble: ComputerTrouble | None = None,
    ) -> None:
        self._supervisor = supervisor
        self.handlers: dict[str, Handler] = {
            "stop": self._stop,
            "estop": self._estop,
            "reset": self._reset,
            "motion.wait": self._motion_wait,
            "motion.stop": self._motion_stop,
            **MotorCommands(supervisor).handlers,
            **BrakeCommands(supervisor).handlers,
            **BrickCommands(supervisor).handlers,
            **EncoderCommands(supervisor).handlers,
            **SetupCommands(supervisor).handlers,
            **NetworkCommands(supervisor).handlers,
            **FrameCommands(supervisor.master.bus, trouble).handlers,
            **NodeCommands(supervisor).handlers,
            **ConfigCommands(supervisor).handlers,
            **SimulationCommands(supervisor, network).handlers,
            **WorkshopCommands(workshop).handlers,
            **FaultCommands(supervisor, faults).handlers,
            **GamepadCommands(supervisor.vehicle).handlers,
            **LookCommands(supervisor, simulated=network is not None).handlers,
        }
        self.paths: PathCommands | None = None
        driving: dict[str, Handler] = {method: self._vehicle_handler(method) for method in supervisor.vehicle.methods}
        if isinstance(supervisor.vehicle, PathVehicle):
            self.paths = PathCommands(supervisor, supervisor.vehicle)
            driving |= self.paths.handlers
        self._driving = frozenset(driving)
        self.handlers |= driving

    async def call(self, method: str, params: Params, lease: str | None) -> dict[str, Any]:
        """Carry out one method.

        Args:
            method: its name, as in ``api.schema``.
            params: validated parameters.
            lease: the caller's lease, for motions.

        Returns:
            The method's result.

        Raises:
            CanhelmError: one of its leaves; Refused for a method that this vehicle does not have, Interlock for a
                motion of a vehicle that was not set up.
        """
        handler = self.handlers.get(method)
        if handler is None:
            have = ", ".join(sorted(self._supervisor.vehicle.methods)) or "none"
            raise Refused(f"this vehicle has no {method}", remedy=f"motions that it has: {have}")
        if method in self._driving and not params.get("dry_run"):
            self._require_set_up()
        if method in OF_A_SETUP:
            self._supervisor.require_no_setup_of_others(lease)
        return await handler(params, lease)

    def _require_set_up(self) -> None:
        profile = self._supervisor.vehicle.profile
        if profile.setup == "needed":
            raise Interlock(
                f"robot {profile.name} was not set up: nobody has seen yet which wheel turns which way",
                remedy="`canhelm setup`, then start the daemon anew; or write setup: waived in its profile",
            )

    # --- the whole vehicle -------------------------------------------------------------------------------------

    async def _stop(self, params: Params, lease: str | None) -> dict[str, Any]:
        told = f"stop was {str(params.get('reason') or 'commanded')[:REASON_LENGTH]}"
        log, moving = self._supervisor.log, bool(self._supervisor.motions)
        if moving and not log.told(told):
            log.add("info", "supervisor", told)
        await self._supervisor.stop(told)
        return {"state": self._supervisor.state.value, **self._still_enabled()}

    def _still_enabled(self) -> Params:
        """Who has power after a stop, and how to take it away: a stop leaves the drives as they were."""
        drives = self._supervisor.devices.drives.values()
        names = [drive.name for drive in drives if drive.state is DriveState.ENABLED]
        if not names:
            return {}
        mend = ", ".join(f"`canhelm motor disable {name}`" for name in names)
        return {"enabled": names, "message": f"at rest, and still enabled; {mend} switches off"}

    async def _estop(self, params: Params, lease: str | None) -> dict[str, Any]:
        self._supervisor.estop(str(params.get("reason") or "commanded by a person"))
        return {"state": self._supervisor.state.value, "message": self._supervisor.message}

    async def _reset(self, params: Params, lease: str | None) -> dict[str, Any]:
        return await self._supervisor.reset()

    def _vehicle_handler(self, method: str) -> Handler:
        async def handle(params: Params, lease: str | None) -> dict[str, Any]:
            supervisor = self._supervisor
            supervisor.require_ready(())
            running = supervisor.vehicle.update(method, params, lease, list(supervisor.motions.values()))
            if running is not None:
                return running
            motion = supervisor.vehicle.motion(method, params, holder(params, lease))
            return await run_motion(supervisor, motion, params, lease)

        return handle

    def _motion(self, params: Params) -> Motion:
        motion = self._supervisor.motions.get(str(params["motion"]))
        if motion is None:
            raise Refused(f"no motion {params['motion']} is running", remedy="`canhelm status` shows the motions")
        return motion

    async def _motion_wait(self, params: Params, lease: str | None) -> dict[str, Any]:
        motion = self._motion(params)
        return {"motion": motion.identity, **await motion.result()}

    async def _motion_stop(self, params: Params, lease: str | None) -> dict[str, Any]:
        motion = self._motion(params)
        motion.stop("its client stopped it")
        await motion.closed.wait()
        return {"motion": motion.identity, "state": self._supervisor.state.value}
