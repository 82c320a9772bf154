"""Serial ports: found, opened for one, lost with a reason."""

import os
import threading
import tty
from collections.abc import Iterator
from types import SimpleNamespace

import pytest

from drivers.errors import DeviceLost
from drivers.transports.serial_port import SerialAddress, SerialLine, find_port, open_serial

PLUGS = [
    SimpleNamespace(device="/dev/ttyUSB3", serial_number="CB-0001"),
    SimpleNamespace(device="/dev/ttyUSB4", serial_number="CB-0002"),
    SimpleNamespace(device="/dev/ttyS0", serial_number=None),
]


@pytest.fixture
def pair() -> Iterator[tuple[int, str]]:
    master, slave = os.openpty()
    tty.setraw(slave)
    path = os.ttyname(slave)
    yield master, path
    os.close(slave)
    os.close(master)


def test_a_port_is_found_by_the_serial_number_of_its_plug():
    assert find_port("CB-0002", lambda: PLUGS) == "/dev/ttyUSB4"


def test_an_unknown_serial_number_names_those_present():
    with pytest.raises(DeviceLost, match=r"'CB-0009'; present: CB-0001 at /dev/ttyUSB3, CB-0002"):
        open_serial(SerialAddress(serial_number="CB-0009"), 9600, lambda: PLUGS)
    with pytest.raises(DeviceLost, match="none with a serial number"):
        find_port("CB-0009", list)


@pytest.mark.parametrize("arguments", [{}, {"port": "/dev/ttyUSB0", "serial_number": "CB-0001"}])
def test_an_address_is_a_path_or_a_serial_number(arguments):
    with pytest.raises(ValueError, match="exactly one"):
        SerialAddress(**arguments)


def test_an_address_reads_as_what_it_is():
    assert str(SerialAddress(port="/dev/ttyUSB0")) == "/dev/ttyUSB0"
    assert str(SerialAddress(serial_number="CB-1")) == "USB serial number CB-1"


def test_bytes_go_both_ways_and_a_read_takes_all_that_is_there(pair):
    master, path = pair
    line = SerialLine(path, 115200)
    line.write(b"ask", 1.0)
    assert os.read(master, 10) == b"ask"
    os.write(master, b"answer")
    assert line.read(100, 1.0) == b"answer"
    os.write(master, b"0123456789")
    assert line.read(4, 1.0) + line.read(100, 1.0) == b"0123456789"
    assert line.read(100, 0.0) == b""
    line.close()


def test_a_missing_port(tmp_path):
    with pytest.raises(DeviceLost, match="does not exist; check the cable") as caught:
        SerialLine(str(tmp_path / "ttyUSB9"), 9600)
    assert isinstance(caught.value.__cause__, OSError)


def test_a_file_is_no_port(tmp_path):
    (tmp_path / "notes").write_text("hello")
    with pytest.raises(DeviceLost, match="notes: cannot be opened"):
        SerialLine(str(tmp_path / "notes"), 9600)


def test_a_port_is_for_one_program_only(pair):
    _, path = pair
    first = SerialLine(path, 9600)
    with pytest.raises(DeviceLost, match=f"{path}: busy; another program"):
        SerialLine(path, 9600)
    first.close()
    SerialLine(path, 9600).close()


def test_a_device_that_does_not_read_is_found_out(pair):
    _, path = pair
    line = SerialLine(path, 9600)
    with pytest.raises(DeviceLost, match="takes no more bytes"):
        line.write(b"x" * 100_000, 0.05)
    line.close()


def test_a_hang_up_while_reading_is_lost():
    master, slave = os.openpty()
    tty.setraw(slave)
    line = SerialLine(os.ttyname(slave), 9600)
    os.close(slave)
    os.close(master)
    with pytest.raises(DeviceLost, match="gone while reading"):
        line.read(10, 1.0)
    line.close()


def test_closing_ends_a_read_of_another_thread(pair):
    _, path = pair
    line = SerialLine(path, 9600)
    outcome: list[object] = []

    def wait() -> None:
        try:
            outcome.append(line.read(10, 30.0))
        except DeviceLost as lost:
            outcome.append(lost)

    reader = threading.Thread(target=wait)
    reader.start()
    line.close()
    reader.join(10.0)
    assert not reader.is_alive()
    assert len(outcome) == 1
    assert outcome[0] == b"" or isinstance(outcome[0], DeviceLost)
    line.close()


class FtdiPort:
    """What pyserial shows of a real plug, writing down what is done with it."""

    def __init__(self) -> None:
        self.done: list[object] = []

    def __setattr__(self, name: str, value: object) -> None:
        if name != "done":
            self.done.append((name, value))
        object.__setattr__(self, name, value)

    def set_low_latency_mode(self, on: bool) -> None:
        self.done.append(("low latency", on))

    def reset_input_buffer(self) -> None:
        self.done.append("purge in")

    def reset_output_buffer(self) -> None:
        self.done.append("purge out")


class NotingClock:
    def __init__(self, done: list[object]) -> None:
        self.done = done

    def now_s(self) -> float:
        return 0.0

    def sleep_s(self, seconds: float) -> None:
        self.done.append(seconds)


def test_an_ftdi_plug_is_prepared_in_the_order_of_the_apt_protocol(pair):
    line = SerialLine(pair[1], 115200)
    real, line._serial = line._serial, FtdiPort()
    done = line._serial.done
    line.begin_apt(NotingClock(done))
    assert done == [
        ("rts", True),
        ("low latency", True),
        0.05,
        "purge in",
        "purge out",
        0.05,
        ("rtscts", True),
        ("rts", True),
    ]
    real.close()


def test_a_port_without_modem_lines_is_left_as_it_is(pair):
    line = SerialLine(pair[1], 115200)
    slept: list[object] = []
    line.begin_apt(NotingClock(slept))
    assert slept == []
    line.close()


def test_a_plug_that_goes_while_it_is_prepared_is_lost():
    master, slave = os.openpty()
    tty.setraw(slave)
    line = SerialLine(os.ttyname(slave), 115200)
    os.close(slave)
    os.close(master)
    with pytest.raises(DeviceLost, match="gone while preparing"):
        line.begin_apt(NotingClock([]))
    line.close()
