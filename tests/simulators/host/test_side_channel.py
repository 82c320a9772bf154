"""Requests to the side channel, and what comes back for bad ones."""

import contextlib
import json
import socket

import pytest

from simulators.host.side_channel import LINE_LIMIT_BYTES, SideChannelWire, side_channel


def refuse(id: int) -> None:  # noqa: A002 - the verb's argument is called id
    raise ValueError(f"no placement {id}; the rig has 1, 2")


VERBS = {"double": lambda x: 2 * x, "fixture.place": refuse, "odd": lambda: object()}


def ask(line: bytes) -> dict:
    return json.loads(SideChannelWire(VERBS).handle(line + b"\n"))


def test_verb_is_done_and_its_result_returned():
    assert ask(b'{"do": "double", "with": {"x": 4}}') == {"ok": True, "result": 8}


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (b"GET / HTTP/1.1", "not JSON"),
        (b"\xff\xfe", "not JSON"),
        (b"[1]", "not an object"),
        (b'{"with": {}}', '"do" is no verb'),
        (b'{"do": "double", "with": 3}', '"do" is no verb or "with" no object'),
        (b'{"do": "dubble", "with": {"x": 1}}', "did you mean 'double'?"),
        (b'{"do": "reveal"}', "there are double, fixture.place, odd"),
        (b'{"do": "double", "with": {"y": 1}}', "missing a required argument: 'x'"),
        (b'{"do": "fixture.place", "with": {"id": 9}}', "no placement 9; the rig has 1, 2"),
        (b'{"do": "odd"}', "not JSON serializable"),
    ],
)
def test_bad_request_gets_its_reason(line, reason):
    answer = ask(line)
    assert answer["ok"] is False
    assert reason in answer["error"]


def test_requests_may_come_in_any_split_and_are_answered_in_order():
    wire = SideChannelWire(VERBS)
    stream = b'{"do": "double", "with": {"x": 1}}\n\n{"do": "double", "with": {"x": 2}}\n'
    answers = b"".join(wire.handle(stream[k : k + 1]) for k in range(len(stream)))
    assert [json.loads(line)["result"] for line in answers.splitlines()] == [2, 4]


def test_endless_line_ends_the_connection():
    wire = SideChannelWire(VERBS)
    answer = wire.handle(b"x" * (LINE_LIMIT_BYTES + 1))
    assert b"end each request with a new line" in answer
    assert wire.closing


def test_it_is_reached_over_a_real_loopback_socket(stage):
    on = stage(side_channel(VERBS))
    host, port = on.host.tcp_address("control")
    assert host == "127.0.0.1"
    with socket.create_connection((host, port), timeout=5.0) as client:
        client.setblocking(False)
        client.sendall(b'{"do": "dubble"}\n{"do": "double", "with": {"x": 21}}\n')
        received = bytearray()

        def both_answered() -> bool:
            with contextlib.suppress(BlockingIOError):
                received.extend(client.recv(4096))
            return received.count(b"\n") == 2

        on.until(both_answered)
    bad, good = (json.loads(line) for line in received.splitlines())
    assert bad["ok"] is False
    assert good == {"ok": True, "result": 42}
