"""The methods of the socket API that do to a simulated robot what one does to a real one by hand."""

from __future__ import annotations

from daemon.api.parameters import Method, Param, Role

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
        "lifted, wheel_deg, heading_deg, brakes_engaged",
        Role.WATCH,
    ),
)
