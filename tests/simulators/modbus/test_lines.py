"""Modbus TCP and RTU byte by byte: examples of the specification, every split, junk, requests nobody should send."""

import random

import pytest

from simulators.modbus.register_map import HOLDING, INPUT, RegisterMemory
from simulators.modbus.server import PATIENCE_TICKS, RtuWire, TcpWire, checksum

# Modbus Application Protocol V1.1b3, sections 6.3, 6.6 and 6.12: their examples, with the registers they read
READ = bytes.fromhex("03 006B 0003")
READ_ANSWER = bytes.fromhex("03 06 022B 0000 0064")
WRITE_ONE = bytes.fromhex("06 0001 0003")
WRITE_MANY = bytes.fromhex("10 0001 0002 04 000A 0102")
WRITE_MANY_ANSWER = bytes.fromhex("10 0001 0002")


@pytest.fixture
def memory() -> RegisterMemory:
    memory = RegisterMemory()
    memory.define(HOLDING, range(0x6B, 0x6E))
    memory.define(HOLDING, range(1, 3), writable=True)
    memory.define(INPUT, [8])
    memory.put(HOLDING, 0x6B, [0x022B, 0x0000, 0x0064])
    memory.put(INPUT, 8, [10])
    return memory


@pytest.fixture
def tcp(memory) -> TcpWire:
    return TcpWire(memory, lambda: False)


@pytest.fixture
def rtu(memory) -> RtuWire:
    return RtuWire(memory, 17, lambda: False)


def over_tcp(pdu: bytes, transaction: int = 0x1234) -> bytes:
    return transaction.to_bytes(2, "big") + b"\0\0" + (len(pdu) + 1).to_bytes(2, "big") + b"\x11" + pdu


def over_rtu(pdu: bytes, unit: int = 17) -> bytes:
    content = bytes((unit,)) + pdu
    return content + checksum(content).to_bytes(2, "little")


def test_the_checksum_of_the_specification() -> None:
    assert checksum(bytes.fromhex("02 07")) == 0x1241  # Modbus over Serial Line V1.02, section 6.2.2


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        (READ, READ_ANSWER),
        (bytes.fromhex("04 0008 0001"), bytes.fromhex("04 02 000A")),
        (WRITE_ONE, WRITE_ONE),
        (WRITE_MANY, WRITE_MANY_ANSWER),
        (bytes.fromhex("03 006B 0004"), bytes.fromhex("83 02")),  # one register too many
        (bytes.fromhex("03 006B 0000"), bytes.fromhex("83 03")),
        (bytes.fromhex("03 006B 007E"), bytes.fromhex("83 03")),
        (bytes.fromhex("06 006B 0001"), bytes.fromhex("86 02")),  # not the client's to write
        (bytes.fromhex("10 0001 0002 05 000A 0102"), bytes.fromhex("90 03")),
        (bytes.fromhex("01 0013 0013"), bytes.fromhex("81 01")),  # coils
        (bytes.fromhex("03 00"), bytes.fromhex("83 03")),
    ],
)
def test_requests_and_their_answers(tcp, request_, answer) -> None:
    assert tcp.handle(over_tcp(request_)) == over_tcp(answer)
    assert not tcp.closing


def test_what_was_written_is_read(tcp, memory) -> None:
    heard: list[tuple[int, int]] = []
    memory.on_write.append(lambda address, word: heard.append((address, word)))
    tcp.handle(over_tcp(WRITE_MANY))
    assert tcp.handle(over_tcp(bytes.fromhex("03 0001 0002"))) == over_tcp(bytes.fromhex("03 04 000A 0102"))
    assert heard == [(1, 0x000A), (2, 0x0102)]


@pytest.mark.parametrize("frame", [over_tcp, over_rtu])
def test_every_split_and_byte_by_byte(frame, memory) -> None:
    request = frame(READ) + frame(WRITE_MANY)
    answer = frame(READ_ANSWER) + frame(WRITE_MANY_ANSWER)
    for cut in range(len(request) + 1):
        wire = TcpWire(memory, lambda: False) if frame is over_tcp else RtuWire(memory, 17, lambda: False)
        assert wire.handle(request[:cut]) + wire.handle(request[cut:]) == answer
    wire = TcpWire(memory, lambda: False) if frame is over_tcp else RtuWire(memory, 17, lambda: False)
    assert b"".join(wire.handle(bytes((byte,))) for byte in request) == answer


def test_rtu_finds_the_next_request_behind_junk(rtu) -> None:
    assert rtu.handle(b"\x55\xaa\x11" + over_rtu(READ)) == over_rtu(READ_ANSWER)


def test_rtu_answers_neither_a_wrong_checksum_nor_another_unit(rtu) -> None:
    spoilt = bytearray(over_rtu(READ))
    spoilt[3] ^= 1
    assert rtu.handle(bytes(spoilt)) == b""
    assert rtu.handle(over_rtu(READ, unit=18)) == b""
    assert rtu.handle(over_rtu(READ)) == over_rtu(READ_ANSWER)


def test_half_an_rtu_request_is_forgotten_after_a_while(rtu) -> None:
    rtu.handle(over_rtu(WRITE_MANY)[:9])
    for _ in range(PATIENCE_TICKS + 1):
        rtu.due()
    assert rtu.handle(over_rtu(READ)) == over_rtu(READ_ANSWER)


@pytest.mark.parametrize("junk", [b"GET / HTTP/1.1\r\n\r\n", bytes(7), b"\0\1\0\0\xff\xff\1"])
def test_what_is_no_modbus_ends_the_tcp_connection(tcp, junk) -> None:
    assert tcp.handle(junk) == b""
    assert tcp.closing


def test_random_bytes_never_break_a_server(memory) -> None:
    rng = random.Random(1)
    for _ in range(2000):
        request = bytearray(over_rtu(rng.choice((READ, WRITE_ONE, WRITE_MANY))))
        for _ in range(rng.randint(1, 4)):
            request[rng.randrange(len(request))] = rng.randrange(256)
        for wire in (TcpWire(memory, lambda: False), RtuWire(memory, 17, lambda: False)):
            wire.handle(bytes(request) + rng.randbytes(rng.randint(0, 300)))
            assert len(wire._pending) <= 1000
