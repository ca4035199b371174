"""The page of the socket API: what the method ``api.schema`` tells, for people."""

from __future__ import annotations

from canhelm import protocol
from canhelm.errors import all_errors
from daemon.api.methods import METHODS, NOTIFICATIONS
from daemon.api.parameters import Method, Param, Role
from daemon.reference.markdown import code, table

HEAD = f"""# API

JSON-RPC 2.0 on the daemon's Unix socket, one object a line, a request at most {protocol.MAX_REQUEST_BYTES} bytes long.
This is version {protocol.API_VERSION} of the API; `hello` tells a daemon's. A request, and its answer:

```json
{{"jsonrpc":"2.0","id":1,"method":"steer","params":{{"pair":"front","angle_deg":20}}}}
{{"jsonrpc":"2.0","id":1,"result":{{"motion":"1","steering_error_deg":0.0488,"duration_s":1.179,"warnings":[]}}}}
```

A method marked *lease* moves something, and the motion belongs to the connection that asked for it. While that waits,
it sends `lease.renew` every {protocol.RENEW_PERIOD_S:g} s. The motion stops when none came for the `lease_timeout_s`
that `hello` tells, and when the connection ends. With `wait` false, a motion with an end is handed to the daemon.

Each method has a role: *{Role.STOP}* is for whoever may open the socket, *{Role.WATCH}*, *{Role.DRIVE}* and
*{Role.CONFIGURE}* are for members of the groups `canhelm-watch`, `canhelm` and `canhelm-admin`
([who may do what](../rights.md)). Which motions a robot has, `status` tells under `vehicle.methods`.

"""
COLUMNS = ("parameter", "type", "unit", "default", "range", "meaning")
ERRORS = f"""## Errors

`data` of an error holds its type, and node, object, value, limit and remedy where they are known. Nonsense is answered
with the codes of JSON-RPC: {protocol.PARSE_ERROR} (no JSON), {protocol.INVALID_REQUEST} (no request),
{protocol.METHOD_NOT_FOUND} (no such method), {protocol.INTERNAL_ERROR} (a defect of the daemon, in its log).

"""
ERROR_COLUMNS = ("code", "type", "exit code", "meaning")


def api() -> str:
    """Every method, notification and error, as Markdown."""
    told = table(("notification", "holds"), ((code(name), text) for name, text in NOTIFICATIONS.items()))
    leaves = [(leaf.rpc_code, code(leaf.__name__), leaf.exit_code, _first_line(leaf.__doc__)) for leaf in all_errors()]
    return "".join(
        (
            f"{HEAD}## Methods\n\n",
            *map(_method, METHODS.values()),
            f"## Notifications\n\nThey come to those who called `subscribe`.\n\n{told}\n",
            f"{ERRORS}{table(ERROR_COLUMNS, leaves)}",
        )
    )


def _method(method: Method) -> str:
    marks = [f"role *{method.role}*", *(["*lease*"] if method.needs_lease else [])]
    choice = f" Exactly one of {', '.join(map(code, method.one_of))} is given." if method.one_of else ""
    params = table(COLUMNS, map(_param, method.params)) + "\n" if method.params else ""
    return f"### {method.name}\n\n{method.doc}{choice} ({', '.join(marks)})\n\n{params}Answer: {method.result}.\n\n"


def _param(param: Param) -> tuple[str, ...]:
    return code(param.name), param.type, param.unit, _default(param), _range(param), param.doc


def _default(param: Param) -> str:
    if param.required:
        return "required"
    if isinstance(param.default, bool):
        return str(param.default).lower()
    return "" if param.default is None else str(param.default)


def _range(param: Param) -> str:
    if param.choices:
        return ", ".join(map(code, param.choices))
    low, high = ("" if bound is None else f"{bound:.12g}" for bound in (param.minimum, param.maximum))
    return f"{low} to {high}" if low and high else f"from {low}" if low else f"to {high}" if high else ""


def _first_line(text: str | None) -> str:
    return (text or "").partition("\n")[0].replace("``", "`")
