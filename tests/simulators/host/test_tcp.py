"""Real sockets: several clients, each with a wire of its own, and none that can end the server."""

import contextlib
import socket

import pytest

from simulators.errors import HostError, PortBusy
from simulators.wire import TICK_S, TcpPort


class Site:
    """A TCP port that remembers the wires it gave away and the ones it got back."""

    def __init__(self, make_wire) -> None:
        self.given, self.returned = [], []

        def accept():
            self.given.append(make_wire())
            return self.given[-1]

        self.port = TcpPort("dashboard", "127.0.0.1", 0, accept, self.returned.append)


class Client:
    def __init__(self, address: tuple[str, int]) -> None:
        self.socket = socket.create_connection(address, timeout=5.0)
        self.socket.setblocking(False)
        self.received = b""
        self.ended = False

    def read(self) -> bytes:
        try:
            data = self.socket.recv(65536)
            self.ended = not data
            self.received += data
        except BlockingIOError:
            pass
        except ConnectionError:
            self.ended = True
        return self.received

    def has_ended(self) -> bool:
        self.read()
        return self.ended


@pytest.fixture
def connect():
    with contextlib.ExitStack() as cleanup:

        def make(on) -> Client:
            client = Client(on.host.tcp_address("dashboard"))
            cleanup.callback(client.socket.close)
            return client

        yield make


def test_every_client_has_a_wire_of_its_own(stage, echo, connect):
    site = Site(echo)
    on = stage(site.port)
    one, two = connect(on), connect(on)
    one.socket.sendall(b"one")
    two.socket.sendall(b"two")
    on.until(lambda: one.read() == b"ONE" and two.read() == b"TWO")
    assert sorted(wire.seen for wire in site.given) == [b"one", b"two"]


def test_clients_that_leave_are_returned_and_others_may_come(stage, echo, connect):
    site = Site(echo)
    on = stage(site.port)
    for visit in range(1, 4):
        client = connect(on)
        client.socket.sendall(b"hi")
        on.until(lambda client=client: client.read() == b"HI")
        client.socket.close()
        on.until(lambda visit=visit: len(site.returned) == visit)
    assert site.returned == site.given


def test_rubbish_loses_its_client_and_nobody_else(stage, echo, connect):
    site = Site(echo)
    on = stage(site.port)
    good, bad, worse = connect(on), connect(on), connect(on)
    bad.socket.sendall(b"break")
    worse.socket.sendall(b"break")
    on.until(lambda: bad.has_ended() and worse.has_ended())
    good.socket.sendall(b"still here")
    on.until(lambda: good.read() == b"STILL HERE")
    assert on.logged == ["dashboard: RuntimeError: that was rubbish (further ones of this kind are not logged)"]
    assert on.host.faults.count == 2


def test_wire_that_says_goodbye_is_closed_after_its_last_word(stage, echo, connect):
    on = stage(Site(echo).port)
    client = connect(on)
    client.socket.sendall(b"quit")
    on.until(client.has_ended)
    assert client.received == b"QUIT"


def test_instrument_can_drop_a_silent_client(stage, echo, connect):
    site = Site(echo)
    on = stage(site.port)
    client = connect(on)
    on.until(lambda: len(site.given) == 1)
    site.given[0].closing = True
    on.until(client.has_ended)
    on.until(lambda: site.returned == site.given)


def test_slow_reader_loses_whole_packages(stage, echo, connect):
    site = Site(echo)
    on = stage(site.port)
    client = connect(on)
    client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    on.until(lambda: len(site.given) == 1)
    for number in range(20000):  # 20 MB: more than any kernel keeps
        site.given[0].output = b"%06d" % number + b"." * 993 + b"\n"
        on.turns()
    site.given[0].output = b"last\n"
    client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)  # or what the kernel keeps comes in drips
    on.until(lambda: client.read().endswith(b"\n") and drained(on))
    packages = client.received.split(b"\n")[:-1]
    assert {len(package) for package in packages} <= {999, 4}
    assert len(packages) < 20000
    assert packages[0].startswith(b"000000")


def test_what_a_late_host_gathers_comes_whole_and_in_order(stage, echo, connect):
    class Counting(echo):
        asked = 0

        def due(self) -> bytes:
            self.asked += 1
            return b"%03d;" % self.asked

    site = Site(Counting)
    on = stage(site.port)
    client = connect(on)
    on.until(lambda: client.read() != b"")
    on.now_s = on.host.pace.next_s + 6.5 * TICK_S
    for _ in range(3):
        on.host.turn(0.0)
    asked = site.given[0].asked
    on.until(lambda: client.read().count(b";") >= asked)
    numbers = [int(number) for number in client.received.split(b";")[:-1]]
    assert numbers == list(range(1, len(numbers) + 1))


def test_the_wire_of_a_client_that_never_reads_is_not_asked(stage, echo, connect):
    class Streaming(echo):
        asked = 0

        def due(self) -> bytes:
            self.asked += 1
            return bytes(10_000)

    site = Site(Streaming)
    on = stage(site.port)
    client = connect(on)
    client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    on.until(lambda: len(site.given) == 1)
    on.turns(2000)  # 20 MB: more than any kernel keeps
    asked = site.given[0].asked
    on.turns(100)
    assert site.given[0].asked == asked < 2000
    on.until(lambda: client.read() and site.given[0].asked > asked)


def drained(on) -> bool:
    return all(connection._outbox.empty for connection in on.host._connections)


def test_port_in_use_is_named_with_its_remedy(stage, echo):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        number = other.getsockname()[1]
        with pytest.raises(PortBusy, match=rf"dashboard: 127\.0\.0\.1:{number} is in use by another program; stop it"):
            stage(TcpPort("dashboard", "127.0.0.1", number, echo))


def test_failed_start_leaves_no_port_open(stage, echo, tmp_path):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        number = free.getsockname()[1]
    with pytest.raises(PortBusy):
        stage(TcpPort("one", "127.0.0.1", number, echo), TcpPort("two", "127.0.0.1", number, echo))
    stage(TcpPort("one", "127.0.0.1", number, echo))


def test_address_of_another_machine_is_refused(stage, echo):
    with pytest.raises(HostError, match=r"192\.0\.2\.1:30004 is no address of this machine"):
        stage(TcpPort("rtde", "192.0.2.1", 30004, echo))  # TEST-NET-1 of RFC 5737
