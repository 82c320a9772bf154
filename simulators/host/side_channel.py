"""The side channel: one JSON object a line asks the bench for what hands do in a workshop.

    {"do": "fixture.place", "with": {"id": 2}}   ->   {"ok": true, "result": null}
    {"do": "fixture.plaice"}                     ->   {"ok": false, "error": "no verb ..."}

Verbs come from the bench, and nothing of the truth goes through it. It listens on loopback; where it does not, every
request must hold the token that the start has announced: {"token": "...", "do": ...}.
"""

import difflib
import inspect
import json
import secrets
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, cast

from simulators.wire import TcpPort

LINE_LIMIT_BYTES = 64 * 1024  # a request is a line of a hundred bytes; this is somebody else's protocol

Verbs = Mapping[str, Callable[..., Any]]


@dataclass(frozen=True)
class Control:
    """Where the side channel listens, and what its clients must know; None: nothing."""

    host: str = "127.0.0.1"
    token: str | None = None


class SideChannelWire:
    """One client of the side channel. Requests are answered in order, each with one line."""

    def __init__(self, verbs: Verbs, token: str | None = None) -> None:
        self._verbs, self._token = verbs, token
        self._buffer = b""
        self.closing = False

    def handle(self, data: bytes) -> bytes:
        *lines, self._buffer = (self._buffer + data).split(b"\n")
        answers = [answer_line(line, self._verbs, self._token) for line in lines if line.strip()]
        if len(self._buffer) > LINE_LIMIT_BYTES:
            self._buffer = b""
            self.closing = True
            answers.append(_refusal(f"a line of more than {LINE_LIMIT_BYTES} bytes; end each request with a new line"))
        return b"".join(answers)

    def due(self) -> bytes:
        return b""


def side_channel(verbs: Verbs, control: Control | None = None) -> TcpPort:
    """The port, on 127.0.0.1 unless set otherwise, with a number that the system chooses."""
    where = control or Control()
    return TcpPort(name="control", host=where.host, port=0, accept=lambda: SideChannelWire(verbs, where.token))


def answer_line(line: bytes, verbs: Verbs, token: str | None = None) -> bytes:
    """Carries one request out and answers it; whatever goes wrong is in the answer."""
    try:
        name, arguments = _read_request(line, token)
        verb = _find_verb(name, verbs)
        inspect.signature(verb).bind(**arguments)
        result = verb(**arguments)
        return json.dumps({"ok": True, "result": result}).encode() + b"\n"
    except Exception as fault:  # the emulators go on whatever a request does
        return _refusal(str(fault) or type(fault).__name__)


def _read_request(line: bytes, token: str | None) -> tuple[str, dict[str, Any]]:
    try:
        request: Any = json.loads(line)
    except ValueError as error:
        raise ValueError(f"not JSON: {error}; send one object a line") from error
    if not isinstance(request, dict):
        raise ValueError('not an object; send {"do": "<verb>", "with": {<arguments>}}')
    fields = cast(dict[str, Any], request)
    if token is not None and not secrets.compare_digest(str(fields.get("token")).encode(), token.encode()):
        raise ValueError('wrong or no "token"; the start of the emulators has announced it')
    name, arguments = fields.get("do"), fields.get("with", {})
    if not isinstance(name, str) or not isinstance(arguments, dict):
        raise ValueError('"do" is no verb or "with" no object; send {"do": "<verb>", "with": {<arguments>}}')
    return name, cast(dict[str, Any], arguments)


def _find_verb(name: str, verbs: Verbs) -> Callable[..., Any]:
    if name not in verbs:
        near = difflib.get_close_matches(name, verbs, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(sorted(verbs))}"
        raise ValueError(f"no verb {name!r}; {hint}")
    return verbs[name]


def _refusal(reason: str) -> bytes:
    return json.dumps({"ok": False, "error": reason}).encode() + b"\n"
