"""The methods of the socket API for paths."""

from __future__ import annotations

from typing import Final

from daemon.api.parameters import Method, Param, Role

_KEPT = Param("kept", "string", "where path.add keeps the first pieces", default=None)
_WAIT = Param("wait", "boolean", "answer when the motion is done; false hands it to the daemon", default=True)

PATH_METHODS: Final = (
    Method(
        "drive.path",
        "Follow a path of lines and arcs.",
        (
            Param("path", "object", "start and pieces, as in a path file"),
            _KEPT,
            Param("backward", "boolean", "exchange forward and backward", default=False),
            Param("speed_m_s", "number", "no faster than; as fast as it may where left out", "m/s", None, 0.001),
            Param(
                "law",
                "string",
                "the better one, or that of the semi-trailer thesis, for vehicles that have both",
                default="cascade",
                choices=("cascade", "published"),
            ),
            Param("dry_run", "boolean", "only check the path, and tell how it would be driven", default=False),
            _WAIT,
        ),
        "motion, length_m, sections, duration_s, end, largest_error_m",
        needs_lease=True,
    ),
    Method(
        "path.add",
        "Keep pieces of a path that is too long for one request, for a drive.path to come.",
        (Param("pieces", "list", "as in a path file"), _KEPT),
        "kept, pieces",
    ),
    Method(
        "path.active",
        "The path that is followed now, piece by piece in the frame of the pose; of more than 2000 the first ones.",
        (),
        "motion (its id, or null), path (start and pieces as in a path file, or null), pieces (how many there are)",
        Role.WATCH,
    ),
)
