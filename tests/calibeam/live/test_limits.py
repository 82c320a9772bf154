"""What slow, silent, loud and many connections may take of the page, and that STOP works all the while."""

import json
import logging
import os
import resource
import socket
import subprocess
import sys
import threading
from collections.abc import Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from http.client import HTTPConnection
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.frames import Opcode
from websockets.sync.client import ClientConnection, connect

from calibeam.live.limits import ACCEPTED_AT_ONCE, POLICY, TOO_MANY, Limits
from calibeam.live.page import LivePage, PageAddress, live_page
from drivers.clock import SystemClock

SLOW = 1_100  # more than a process may have open files where the limit is 1,024, as it often is
FILES = 64 + 7 * ACCEPTED_AT_ONCE  # the connections, and those accepted before the loop has closed the ones before them
PATIENCE_S = 30.0

# In a process of its own, so that the client's ends do not count as the page's files.
CLIENT = """
import resource, socket, sys
hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
host, port, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
lines = []
for _ in range(count):
    lines.append(socket.create_connection((host, port), 30.0))
    try:
        lines[-1].send(b"GET / HTTP/1.1\\r\\nHost: 127")
    except OSError:
        pass
print(len(lines), flush=True)
sys.stdin.read()
"""


def address(page: LivePage) -> tuple[str, int]:
    host, _, port = page.url.removeprefix("http://").strip("/").partition(":")
    return host, int(port)


def watching(page: LivePage) -> ClientConnection:
    host, port = address(page)
    origin = f"http://{host}:{port}"
    return connect(f"ws://{host}:{port}/feed", origin=origin, open_timeout=PATIENCE_S)  # pyright: ignore[reportArgumentType]


def stopped_by(page: LivePage) -> bool:
    """STOP as a page sends it: a request, on a connection of its own."""
    host, port = address(page)
    line = HTTPConnection(host, port, timeout=PATIENCE_S)
    try:
        line.request("POST", "/stop", headers={"Origin": f"http://{host}:{port}"})
        return bool(json.loads(line.getresponse().read())["delivered"])
    finally:
        line.close()


def opened(page: LivePage, begun: bytes = b"") -> socket.socket:
    line = socket.create_connection(address(page), PATIENCE_S)
    line.sendall(begun)
    return line


def ended(line: socket.socket) -> bytes:
    """All that came until the far end closed; TimeoutError when it does not."""
    got = b""
    try:
        while piece := line.recv(65536):
            got += piece
    except ConnectionError:
        pass
    line.close()
    return got


@contextmanager
def served(rig, **limits: float) -> Generator[LivePage]:
    with live_page(rig, SystemClock(), PageAddress(port=0), limits=Limits(**limits)) as page:  # pyright: ignore[reportArgumentType]
        yield page


@contextmanager
def slow_connections(page: LivePage, count: int) -> Generator[int]:
    host, port = address(page)
    command = [sys.executable, "-c", CLIENT, host, str(port), str(count)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as client:
        assert client.stdout is not None
        assert client.stdin is not None
        yield int(client.stdout.readline())
        client.stdin.close()


@pytest.fixture
def few_files() -> Iterator[None]:
    """So few that the slow connections would use up all of them."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    used = max(map(int, os.listdir("/dev/fd"))) + 1
    resource.setrlimit(resource.RLIMIT_NOFILE, (used + FILES, hard))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_stop_and_recording_work_while_many_slow_connections_are_open(
    rig, few_files, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    assert SLOW > FILES
    stops: list[int] = []
    with served(rig) as page, watching(page) as viewer, slow_connections(page, SLOW) as made:
        page.feed.stops_by(lambda: stops.append(1))
        assert made == SLOW
        assert stopped_by(page)
        with (tmp_path / "segment-0002.mcap").open("wb") as file:
            assert file.writable()
        for _ in range(20):  # more than may be on the way: it is still served
            viewer.recv(timeout=PATIENCE_S)
            viewer.send("1")
        assert stopped_by(page)
    assert len(stops) == 2
    assert not [record for record in caplog.records if record.levelno >= logging.ERROR]


@pytest.mark.parametrize("begun", [b"", b"GET / HTT", b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n"])
def test_a_header_that_is_not_complete_in_time_ends_the_connection(rig, begun: bytes) -> None:
    with served(rig, request_s=0.05) as page:
        assert ended(opened(page, begun)) == b""


def test_a_connection_is_closed_when_no_request_follows(rig) -> None:
    with served(rig, request_s=1.0) as page:  # enough for the first request on a loaded machine
        host, port = address(page)
        answer = ended(opened(page, f"HEAD / HTTP/1.1\r\nHost: {host}:{port}\r\n\r\n".encode()))
    assert answer.startswith(b"HTTP/1.1 200")


def test_an_answer_that_nobody_waits_for_any_longer_ends_the_connection(rig) -> None:
    release = threading.Event()

    def hang() -> None:
        release.wait(PATIENCE_S)

    with served(rig, answer_s=0.05) as page:
        page.feed.stops_by(hang)
        host, port = address(page)
        head = f"POST /stop HTTP/1.1\r\nHost: {host}:{port}\r\nOrigin: http://{host}:{port}\r\n\r\n"
        assert ended(opened(page, head.encode())) == b""
        release.set()


@pytest.mark.parametrize(
    "head",
    [
        b"GET /?" + b"x" * 600 + b" HTTP/1.1\r\n",
        b"GET / HTTP/1.1\r\nCookie: " + b"x" * 600,
        b"POST /stop HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 600\r\n\r\n" + b"x" * 600,
    ],
    ids=["address", "header", "body"],
)
def test_a_request_that_is_too_long_is_refused(rig, head: bytes) -> None:
    with served(rig, request_bytes=500, request_s=2.0 * PATIENCE_S) as page:
        answer = ended(opened(page, head))
    assert not answer or answer.startswith(b"HTTP/1.1 413")  # nothing: a reset overtook it


def test_the_connection_that_has_waited_longest_makes_room(rig) -> None:
    with served(rig, connections=3) as page, watching(page) as viewer:
        first, second = opened(page), opened(page)
        third = opened(page)
        assert ended(first) == b""
        assert stopped_by(page) is False  # no arm; but heard, and for it the second has gone
        assert ended(second) == b""
        viewer.recv(timeout=PATIENCE_S)
        third.close()


def test_a_stop_under_way_is_not_closed_for_others(rig) -> None:
    pressed, release = threading.Event(), threading.Event()

    def hang() -> None:
        pressed.set()
        release.wait(PATIENCE_S)

    with served(rig, connections=2) as page:
        page.feed.stops_by(hang)
        delivered: list[bool] = []
        press = threading.Thread(target=lambda: delivered.append(stopped_by(page)))
        press.start()
        assert pressed.wait(PATIENCE_S)
        slow = [opened(page) for _ in range(4)]
        for line in slow[:3]:
            assert ended(line) == b""
        release.set()
        press.join()
        slow[3].close()
    assert delivered == [True]


def test_stops_pressed_together_are_all_under_way_at_once(rig) -> None:
    together = threading.Barrier(12)  # more than the threads that asyncio gives to everything else on a small machine
    with served(rig) as page:
        page.feed.stops_by(lambda: together.wait(PATIENCE_S) and None)
        with ThreadPoolExecutor(together.parties) as pages:
            assert all(pages.map(stopped_by, [page] * together.parties))


def close_code(viewer: ClientConnection) -> int:
    with suppress(ConnectionClosed):
        for _ in viewer:
            pass
    assert viewer.close_code is not None
    return viewer.close_code


def test_more_viewers_than_allowed_are_refused_with_a_reason(rig) -> None:
    with served(rig, viewers=1) as page, watching(page) as viewer:
        viewer.recv(timeout=PATIENCE_S)
        with watching(page) as other:
            assert close_code(other) == TOO_MANY
        assert stopped_by(page) is False  # heard: there is no arm
        viewer.recv(timeout=PATIENCE_S)


def test_a_viewer_that_acknowledges_nothing_is_closed(rig) -> None:
    with served(rig, silent_viewer_s=0.05) as page, watching(page) as viewer:
        assert close_code(viewer) == 1000


@pytest.mark.parametrize("ping", [False, True])
def test_a_viewer_that_sends_too_much_is_closed(rig, ping: bool) -> None:
    limits = Limits()
    most = limits.request_bytes + limits.viewer_bytes_a_second  # the handshake's share is left over in the first second
    with served(rig) as page, watching(page) as viewer:
        frame = bytes([0x80 | (Opcode.PING if ping else Opcode.TEXT), 0x80, 0, 0, 0, 0])  # empty, with a mask of zeros
        viewer.socket.sendall(frame * (most // len(frame) + 1))  # at once, so that all of it is read before the end
        assert close_code(viewer) == POLICY


def test_a_message_that_is_too_long_ends_the_viewer(rig) -> None:
    with served(rig) as page, watching(page) as viewer:
        viewer.send("1" * (Limits().viewer_message_bytes + 1))
        assert close_code(viewer) == 1009
