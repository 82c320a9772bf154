"""Real pseudo-terminals: clients that come, go, and come again."""

import contextlib
import os
import termios
import tty
from pathlib import Path

import pytest
import serial

from simulators.errors import HostError
from simulators.wire import SerialPort


class Client:
    """The far end of a terminal, raw, not blocking."""

    def __init__(self, path: str) -> None:
        self.fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self.fd)
        self.received = b""

    def read(self) -> bytes:
        with contextlib.suppress(BlockingIOError):
            self.received += os.read(self.fd, 65536)
        return self.received

    def close(self) -> None:
        os.close(self.fd)


def test_client_is_answered_and_sent_what_falls_due(stage, echo):
    wire = echo()
    on = stage(SerialPort("psd", wire))
    client = Client(on.host.serial_address("psd"))
    os.write(client.fd, b"hello\x00\x03\x11\x0d\x0a")  # bytes that a terminal in cooked mode would eat or change
    on.until(lambda: client.read() == b"HELLO\x00\x03\x11\x0d\x0a")
    wire.output = b"\x00\x0a\xff stream"
    on.until(lambda: client.read().endswith(b"\x00\x0a\xff stream"))
    client.close()


def test_next_client_is_served_and_not_greeted_with_the_last_ones_leftovers(stage, echo):
    wire = echo()
    on = stage(SerialPort("psd", wire))
    for visit in range(3):
        client = Client(on.host.serial_address("psd"))
        question = f"visit {visit}".encode()
        os.write(client.fd, question)
        on.until(lambda client=client, question=question: client.read() == question.upper())
        wire.output = b"never read"
        on.turns(3)
        client.close()
        wire.output = b"sent to nobody"
        on.turns(3)
        assert wire.output == b""  # time passes for the wire also when nobody listens


def test_no_event_storm_while_nobody_has_the_port_open(stage, echo):
    on = stage(SerialPort("psd", echo()))
    client = Client(on.host.serial_address("psd"))
    os.write(client.fd, b"x")
    on.until(lambda: client.read() == b"X")
    client.close()
    on.turns(3)
    assert on.host._selector.select(0.0) == []


def test_pyserial_opens_the_port_by_its_link(stage, echo, tmp_path: Path):
    link = tmp_path / "deep" / "psd"
    on = stage(SerialPort("psd", echo(), link=str(link)))
    assert on.host.serial_address("psd") == str(link)
    with serial.Serial(str(link), 115200, timeout=0, exclusive=True) as port:
        port.write(b"abc")
        received = bytearray()
        on.until(lambda: received.extend(port.read(100)) or received == b"ABC")
    on.host.close()
    assert not link.is_symlink()


def test_client_that_does_not_read_loses_whole_outputs_and_holds_up_nobody(stage, echo):
    lazy_wire, quick_wire = echo(), echo()
    on = stage(SerialPort("lazy", lazy_wire), SerialPort("quick", quick_wire))
    lazy, quick = Client(on.host.serial_address("lazy")), Client(on.host.serial_address("quick"))
    on.turns(2)
    line = b"%06d" + b"." * 993 + b"\n"
    for number in range(400):
        lazy_wire.output = line % number
        quick_wire.output = b"q"
        on.turns()
    on.until(lambda: quick.read() == b"q" * 400)
    seen = b""
    while True:
        lazy.received = b""
        on.turns(2)
        if not lazy.read():
            break
        seen += lazy.received
    numbers = [int(whole[:6]) for whole in seen.split(b"\n")[:-1]]
    assert all(len(whole) == 999 for whole in seen.split(b"\n")[:-1])
    assert numbers[:50] == list(range(50))
    assert len(numbers) < 400
    lazy.close()
    quick.close()


def test_wire_at_fault_is_logged_once_and_the_port_goes_on(stage, echo):
    on = stage(SerialPort("psd", echo()))
    client = Client(on.host.serial_address("psd"))
    for count in range(1, 4):
        os.write(client.fd, b"break")
        on.until(lambda count=count: on.host.faults.count == count)
    os.write(client.fd, b"fine")
    on.until(lambda: client.read() == b"FINE")
    assert len(on.logged) == 1
    assert "psd: RuntimeError: that was rubbish" in on.logged[0]
    client.close()


def test_left_over_link_is_replaced(stage, echo, tmp_path: Path):
    link = tmp_path / "psd"
    link.symlink_to("/dev/pts/no-such-terminal")
    on = stage(SerialPort("psd", echo(), link=str(link)))
    client = Client(str(link))
    assert os.readlink(link) == os.ttyname(client.fd)
    on.host.close()
    client.close()


@pytest.mark.parametrize("kind", ["file", "folder", "link to something that exists"])
def test_what_is_no_left_over_link_is_not_replaced(stage, echo, tmp_path: Path, kind):
    link = tmp_path / "psd"
    if kind == "file":
        link.write_text("precious")
    elif kind == "folder":
        link.mkdir()
    else:
        link.symlink_to(tmp_path)
    with pytest.raises(HostError, match=r"psd: .*psd (exists and is no link|already leads to)"):
        stage(SerialPort("psd", echo(), link=str(link)))
    assert link.exists()


def test_second_emulator_does_not_steal_the_link_of_the_first(stage, echo, tmp_path: Path):
    link = str(tmp_path / "psd")
    first = stage(SerialPort("psd", echo(), link=link))
    leads_to = os.readlink(link)
    with pytest.raises(HostError, match="stop the emulator that uses it"):
        stage(SerialPort("psd", echo(), link=link))
    assert os.readlink(link) == leads_to
    first.host.close()
    assert not os.path.lexists(link)


def test_terminal_stays_raw_between_clients(stage, echo):
    on = stage(SerialPort("psd", echo()))
    for _ in range(2):
        fd = os.open(on.host.serial_address("psd"), os.O_RDWR | os.O_NOCTTY)
        assert not termios.tcgetattr(fd)[3] & (termios.ECHO | termios.ICANON)
        os.close(fd)
        on.turns(2)
