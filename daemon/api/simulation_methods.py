"""The methods of the socket API that do to a simulated robot what one does to a real one by hand."""

from __future__ import annotations

from daemon.api.parameters import Method, Param, Role
from profiles.faults import KIND_NAMES

_NODE = Param("node", "node", "node id, or name from the profile")

SIMULATION_METHODS = (
    Method(
        "simulation.power",
        "Switch the supply of a simulated node.",
        (Param("node", "node", "node id, name, or all"), Param("on", "boolean", "on or off")),
        "node, on",
    ),
    Method(
        "simulation.input",
        "Apply a level to a digital input of a simulated drive.",
        (
            _NODE,
            Param("input", "integer", "number of the digital input", minimum=1, maximum=6),
            Param("level", "string", "what is applied", choices=("low", "high")),
        ),
        "node, input, level",
    ),
    Method(
        "simulation.turn",
        "Hold the axis of a simulated encoder by hand, as for a calibration.",
        (_NODE, Param("angle_deg", "number", "where it is held; let go where left out", "deg", None, -180.0, 180.0)),
        "node, angle_deg",
    ),
    Method(
        "simulation.slope",
        "Tilt the floor under the simulated robot; 0 makes it level again.",
        (
            Param("slope_deg", "number", "against the level", "deg", minimum=0.0, maximum=20.0),
            Param("direction_deg", "number", "that leads down, in the frame of true poses", "deg", 0.0, -360.0, 360.0),
        ),
        "slope_deg, direction_deg",
    ),
    Method(
        "simulation.pace",
        "Let the time of a robot that is simulated in the daemon's process pass faster or slower, as far as the "
        "machine can follow; leases and set-points go on being good in the client's time.",
        (Param("factor", "number", "seconds of the simulation in one outside", "", minimum=0.1, maximum=4.0),),
        "factor",
    ),
    Method(
        "simulation.lift",
        "Put the simulated robot onto blocks, its wheels in the air, or down again.",
        (Param("lifted", "boolean", "onto blocks"),),
        "lifted",
    ),
    Method(
        "simulation.hand",
        "Turn a wheel of the lifted simulated robot by hand, or push a wheel pair.",
        (
            Param("name", "string", "wheel by its drive, or pair by its encoder, as the robot is built"),
            Param("angle_deg", "number", "forward, or counter-clockwise", "deg", minimum=-36000.0, maximum=36000.0),
        ),
        "name, turned_deg",
    ),
    Method(
        "simulation.look",
        "What can be seen of the simulated robot.",
        (),
        "stands, lifted, floor (its slope), wheel_deg, heading_deg, brakes_engaged",
        Role.WATCH,
    ),
    Method(
        "simulation.fault",
        "Put a fault into the simulated network; which parameters a kind takes stands in docs/faults.md.",
        (
            Param("kind", "string", "what happens", choices=tuple(sorted(KIND_NAMES))),
            Param("part", "node", "drive, encoder, brake or brick that it happens to", default=None),
            Param("cob_id", "integer", "frames of this identifier only", "", None, 0, 0x7FF),
            Param("object", "string", "SDO transfers of this object only, as 0x6060 or 0x1018/2", default=None),
            Param("at_s", "number", "when it begins, after now", "s", None, 0.0),
            Param("at_frame", "integer", "with which frame it begins, the next one being 1", "", None, 1, 1e9),
            Param("for_s", "number", "how long it lasts; until it is cleared where left out", "s", None, 0.0),
            Param("nth", "integer", "only this one of the frames or requests that fit", "", None, 1, 1e9),
            Param("probability", "number", "share that it strikes, greater than 0 and to 1", default=None),
            Param("times", "integer", "how many it strikes at most", "", None, 1, 1e9),
            Param("delay_s", "number", "by how much frames come late", "s", None, 0.0),
            Param("code", "integer", "EMCY code, or SDO abort code", "", None, 0, 0xFFFF_FFFF),
            Param("value", "integer", "what an object says instead of the truth", "", None, 0, 0xFFFF_FFFF),
            Param("angle_deg", "number", "of an encoder: of the motor shaft, or the steered axis", "deg", None),
            Param("friction", "number", "coefficient of friction", "", None, 0.0, 2.0),
            Param("jump_s", "number", "by how much the daemon's clock is set", "s", None, -1e9, 1e9),
            Param("clients", "integer", "how many clients flood the daemon", "", None, 1, 64),
        ),
        "fault (its number), kind, state (waiting, acting, over), struck (how often), and what was asked for",
    ),
    Method(
        "simulation.faults",
        "The faults that were set, and how often each has struck.",
        (),
        "faults: each as simulation.fault returns it",
        Role.WATCH,
    ),
    Method(
        "simulation.clear_faults",
        "Take away a fault of the simulated network, or all.",
        (Param("fault", "integer", "number of the fault; all where left out", "", None, 1),),
        "cleared (how many)",
    ),
)
