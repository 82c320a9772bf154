"""A process that calls third-party clients of the controller, step by step, and reports what each call gave.

    python call_clients.py ur_rtde|urx HOST CONTROL_PORT < steps.json > results

The first line names the public methods of the client's classes; the others are results. A step is
{"on": object, "call": method, "args": [...]}; a result {"value": ...}, {"error": "..."} or {"hangs": true}, after which
nothing more is called. On "world" a call is a verb of the side channel. A step may ask to be repeated, the last result
counts: with "again": true for 0.2 s of the controller's time, with "until": text until the result contains it, with
"reaches": [value, tolerance] until it is that (calls.py says why).
"""

import collections
import collections.abc
import datetime
import inspect
import json
import os
import socket
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

HANGS_S = 20.0  # a call that answers takes milliseconds, or the few seconds of a move; the clients' own limit is 300 s
AGAIN_S = 0.2  # hundred cycles
Objects = dict[str, Any]


def main() -> None:
    family, host, port = sys.argv[1], sys.argv[2], int(sys.argv[3])
    objects = Objects(world=Verbs(host, port))
    makers = FAMILIES[family](host)
    report({name: public_names(kind) for name, kind in CLASSES.items()})
    for step in json.load(sys.stdin):
        result = take(step, objects, makers)
        report(result)
        if "hangs" in result:
            break
    os._exit(0)  # some clients leave threads behind that never end


def report(what: dict[str, Any]) -> None:
    """One line, at once: a client that crashes leaves what was before."""
    sys.stdout.write("\n" + json.dumps(what) + "\n")
    sys.stdout.flush()


class Verbs:
    """The emulator's side channel."""

    def __init__(self, host: str, port: int) -> None:
        self._address = (host, port)

    def do(self, verb: str, arguments: dict[str, Any]) -> Any:
        with socket.create_connection(("127.0.0.1", self._address[1]), 5.0) as line:
            line.sendall(json.dumps({"do": verb, "with": arguments}).encode() + b"\n")
            answer = json.loads(line.makefile().readline())
        return answer["result"] if answer["ok"] else f"refused: {answer['error']}"


CLASSES: dict[str, type] = {}


def ur_rtde(host: str) -> dict[str, Callable[[], Any]]:
    import dashboard_client
    import rtde_control
    import rtde_io
    import rtde_receive
    import script_client

    CLASSES.update(
        control=rtde_control.RTDEControlInterface,
        receive=rtde_receive.RTDEReceiveInterface,
        io=rtde_io.RTDEIOInterface,
        dashboard=dashboard_client.DashboardClient,
        script=script_client.ScriptClient,
    )
    return {
        "control": lambda: rtde_control.RTDEControlInterface(host, rt_priority=-1),
        "receive": lambda: rtde_receive.RTDEReceiveInterface(host, rt_priority=-1),
        "io": lambda: rtde_io.RTDEIOInterface(host),
        "dashboard": lambda: dashboard_client.DashboardClient(host),
        "script": lambda: script_client.ScriptClient(host, 5, 12),
    }


def urx(host: str) -> dict[str, Callable[[], Any]]:
    collections.Iterable = collections.abc.Iterable  # type: ignore[attr-defined]  # math3d 3 is older than Python 3.10
    import urx as client
    from urx.urrtmon import URRTMonitor
    from urx.ursecmon import SecondaryMonitor

    CLASSES.update(robot=client.Robot, secondary=SecondaryMonitor, realtime=URRTMonitor)
    robot = client.Robot(host, use_rt=True)
    return {"robot": lambda: robot, "secondary": lambda: robot.secmon, "realtime": lambda: robot.rtmon}


FAMILIES: dict[str, Callable[[str], dict[str, Callable[[], Any]]]] = {"ur_rtde": ur_rtde, "urx": urx}


def public_names(kind: type) -> list[str]:
    """Methods and properties of a class, without what a thread has anyway."""
    inherited = set(dir(threading.Thread)) if issubclass(kind, threading.Thread) else set[str]()
    names = (name for name in dir(kind) if not name.startswith("_") and name not in inherited - kind.__dict__.keys())
    return sorted(name for name in names if callable(member := inspect.getattr_static(kind, name)) or is_read(member))


def is_read(member: Any) -> bool:
    return isinstance(member, property) or hasattr(member, "__func__")


def take(step: dict[str, Any], objects: Objects, makers: dict[str, Callable[[], Any]]) -> dict[str, Any]:
    outcome: dict[str, Any] = {}

    def work() -> None:
        try:
            outcome["value"] = plain(repeated(step, objects, makers))
        except BaseException as error:  # whatever a client raises is its answer
            outcome["error"] = f"{type(error).__name__}: {error}"

    began_s = time.monotonic()
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(HANGS_S)
    return {**(outcome.copy() or {"hangs": True}), "took_s": time.monotonic() - began_s}


def repeated(step: dict[str, Any], objects: Objects, makers: dict[str, Callable[[], Any]]) -> Any:
    value = once(step, objects, makers)
    if step.get("again") and "receive" in objects:  # of ur_rtde
        until_s = objects["receive"].getTimestamp() + AGAIN_S
        while objects["receive"].getTimestamp() < until_s:
            value = once(step, objects, makers)
            time.sleep(0.005)
    while "reaches" in step and not _near(plain(value), *step["reaches"]):
        time.sleep(0.005)
        value = once(step, objects, makers)
    while "until" in step and step["until"] not in json.dumps(plain(value)):
        time.sleep(0.005)
        value = once(step, objects, makers)
    return value


def _near(value: Any, expected: Any, tolerance: float) -> bool:
    if isinstance(expected, list):
        return all(_near(v, e, tolerance) for v, e in zip(value, expected, strict=True))
    return value == expected if not tolerance else abs(value - expected) <= tolerance


def once(step: dict[str, Any], objects: Objects, makers: dict[str, Callable[[], Any]]) -> Any:
    name, call = step["on"], step["call"]
    if call == "(new)":
        objects.pop(name, None)
        objects[name] = makers[name]()
        return "made"
    if name not in objects:
        objects[name] = makers[name]()
    arguments = [argument_of(argument, objects[name]) for argument in step.get("args", [])]
    if call.endswith("="):
        setattr(objects[name], call[:-1], *arguments)
        return None
    member = getattr(objects[name], call)
    return member(*arguments) if callable(member) else member


def argument_of(argument: Any, client: Any) -> Any:
    """What JSON cannot hold: {"path": [[...]]} and {"period": true} of ur_rtde, {"transform": pose} of urx."""
    if not isinstance(argument, dict):
        return argument
    if "path" in argument:
        from rtde_control import Path, PathEntry

        path = Path()
        for numbers in argument["path"]:
            path.addEntry(PathEntry(PathEntry.MoveJ, PathEntry.PositionJoints, numbers))
        return path
    if "transform" in argument:
        import math3d

        return math3d.Transform(argument["transform"])
    return client.initPeriod() if "period" in argument else argument


def plain(value: Any) -> Any:
    """What JSON can hold of a result."""
    if isinstance(value, datetime.timedelta):
        return value.total_seconds()
    if isinstance(value, bool | int | float | str | None):
        return value
    if isinstance(value, bytes):
        return value.decode("latin-1")
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    for read in ("pose_vector", "array", "data"):
        if type(value).__module__.startswith("math3d") and hasattr(value, read):
            return plain(getattr(value, read))
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return str(value)


if __name__ == "__main__":
    main()
