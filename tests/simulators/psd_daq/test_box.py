"""The emulated PSD box: the documented bytes, sampling, line time, flags, refusals, faults."""

import struct
import tomllib
from itertools import pairwise
from pathlib import Path

import pytest
from cobs import cobs

from simulators.psd_daq.emulator import build
from simulators.psd_daq.frames import checksum
from simulators.wire import TICK_S
from simulators.world.world import World

ROOT = Path(__file__).parents[3]
DOCUMENT = ROOT / "docs/protocols/psd-daq.md"
BYTE_S = 10 / 3_000_000


def documented(name: str) -> bytes:
    for line in DOCUMENT.read_text().split("```frames\n")[1].split("```")[0].splitlines():
        if line.startswith(name + "  "):
            return bytes.fromhex(line[len(name) :])
    raise KeyError(name)


def request(kind: int, body: bytes = b"", version: int = 1) -> bytes:
    content = bytes((version, kind)) + body
    return cobs.encode(content + struct.pack("<H", checksum(content))) + b"\0"


def start(rate_hz: int) -> bytes:
    return request(0x02, struct.pack("<H", rate_hz))


def contents(data: bytes) -> list[bytes]:
    """What is in the frames of a stretch of line, CRC checked and left out."""
    found = [cobs.decode(part) for part in data.split(b"\0") if part]
    assert all(checksum(part[:-2]) == int.from_bytes(part[-2:], "little") for part in found)
    return [part[:-2] for part in found]


def samples(data: bytes) -> list[tuple[int, int, int, int]]:
    """(sequence, time in us, period in ns, count) of every DATA frame."""
    return [struct.unpack_from("<IQIB", part, 2) for part in contents(data) if part[1] == 0x90]


def joined(sent: list[tuple[float, bytes]]) -> bytes:
    return b"".join(data for _, data in sent)


# --- requests


def test_the_documented_dialogue(box):
    assert box.ask(documented("IDENTIFY")) == documented("IDENTITY")
    assert box.ask(documented("START_STREAM 1000")).startswith(documented("ACK START_STREAM"))
    assert contents(box.ask(documented("STOP_STREAM")))[-1] == b"\x01\x82\x03"
    assert contents(box.ask(documented("PING"))) == [b"\x01\x82\x04"]
    assert box.ask(start(5000)) == documented("NAK START_STREAM")


def test_the_documented_sample(box):
    """The frame of the document, from the currents it speaks of: only sequence, time and CRC differ."""
    box.world.currents_a = lambda t_s: [90e-6, 110e-6, 100e-6, 100e-6, 0.0, -2e-9, 1.5e-9, 0.5e-9]
    box.ask(start(100))
    expected = cobs.decode(documented("DATA")[:-1])
    sent = contents(joined(box.run(0.05)))[0]
    assert sent[18:-2] == expected[18:-4]  # from the count on: one sample, temperature, currents
    assert sent[-2:] == b"\x08\x00"


@pytest.mark.parametrize("cut", range(1, 7))
def test_a_request_in_two_pieces(box, cut):
    whole = documented("START_STREAM 1000")
    assert box.wire.handle(whole[:cut]) == b""
    assert box.ask(whole[cut:]).startswith(documented("ACK START_STREAM"))


def test_damaged_requests_are_ignored_and_the_next_is_obeyed(box):
    ping = documented("PING")
    for damaged in (b"\xff" * 500 + b"\0", ping[:-2] + b"\x01\0", b"\x02\x01\0", b"\0\0\0"):
        assert box.ask(damaged) == b""
    assert contents(box.ask(ping)) == [b"\x01\x82\x04"]


@pytest.mark.parametrize(
    ("frame", "kind", "code", "words"),
    [
        (request(0x55), 0x55, 1, b"no request 0x55"),
        (request(0x01, b"x"), 0x01, 2, b"body of 1 bytes, expected 0"),
        (start(99), 0x02, 3, b"99 Hz"),
        (start(4001), 0x02, 3, b"4001 Hz"),
        (request(0x01, version=2), 0x01, 4, b"version 1"),
    ],
)
def test_refusals_name_code_and_reason(box, frame, kind, code, words):
    (nak,) = contents(box.ask(frame))
    assert nak[:4] == bytes((1, 0x83, kind, code))
    assert words in nak[5:]


# --- sampling and the line


@pytest.mark.parametrize(("rate_hz", "in_a_frame"), [(100, 1), (250, 2), (1000, 10), (3000, 30), (4000, 32)])
def test_samples_are_taken_at_the_rate_and_numbered(box, rate_hz, in_a_frame):
    box.wire.handle(start(rate_hz))
    frames = samples(joined(box.run(1.0)))
    assert box.world.rate_hz == rate_hz
    assert [frame[3] for frame in frames] == [in_a_frame] * len(frames)
    assert rate_hz - 2 * in_a_frame <= sum(frame[3] for frame in frames) <= rate_hz
    assert [frame[0] for frame in frames] == [in_a_frame * i for i in range(len(frames))]
    period_us = 1e6 / rate_hz
    assert all(abs(b[1] - a[1] - in_a_frame * period_us) <= 1.0 for a, b in pairwise(frames))


def test_the_world_is_asked_once_for_every_sample_within_the_step(box):
    box.wire.handle(start(1000))
    box.run(0.5)
    assert len(box.world.asked_s) == 500
    assert all(b > a for a, b in pairwise(box.world.asked_s))
    assert max(box.world.asked_s) <= box.world.time_s


def test_no_frame_arrives_before_its_last_sample_and_its_bytes(box):
    """1 kHz, frames of ten; bytes cannot be there sooner than the line carries them, nor later than the next tick."""
    box.wire.handle(start(1000))
    for now_s, data in box.run(0.5):
        for sequence, time_us, period_ns, count in samples(data):
            earliest_s = time_us * 1e-6 + (count - 1) * period_ns * 1e-9 + 350 * BYTE_S
            assert earliest_s <= now_s, f"frame {sequence}"
            assert now_s < earliest_s + 2 * TICK_S, f"frame {sequence}"


def test_a_line_too_slow_for_the_rate_drops_whole_frames_and_the_count_shows_it(slow_box):
    slow_box.wire.handle(start(1000))
    sent = slow_box.run(2.0)
    frames = samples(joined(sent))
    steps = {b[0] - a[0] for a, b in pairwise(frames)}
    assert max(steps) > 10
    assert all(step % 10 == 0 for step in steps)
    delivered = sum(len(data) for _, data in sent)
    assert delivered <= 2.0 * 115_200 / 10
    assert delivered > 0.9 * (2.0 * 115_200 / 10)


def test_stopping_ends_the_data(box):
    box.wire.handle(start(1000))
    box.run(0.1)
    box.ask(documented("STOP_STREAM"))
    assert box.run(0.5) == []


def test_starting_again_counts_from_zero_at_the_new_rate(box):
    box.wire.handle(start(1000))
    box.run(0.1)
    box.wire.handle(start(500))
    frames = samples(joined(box.run(0.1)))
    first = next(frame for frame in frames if frame[2] == 2_000_000)
    assert first[0] == 0


# --- flags


def flags_of(box, currents_a: list[float]) -> int:
    box.world.currents_a = lambda t_s: currents_a
    box.wire.handle(start(100))
    (first, *_) = contents(joined(box.run(0.05)))[1:]
    return int.from_bytes(first[-2:], "little")


@pytest.mark.parametrize(
    ("currents_a", "flags"),
    [
        ([100e-6] * 8, 0),
        ([600e-6, *[100e-6] * 7], 0x1),
        ([100e-6] * 4 + [100e-6, 100e-6, 100e-6, 500e-6], 0x2),
        ([0.0] * 4 + [100e-6] * 4, 0x4),
        ([100e-6] * 4 + [0.4e-6] * 4, 0x8),
        ([100e-6] * 4 + [0.6e-6] * 4, 0x0),
    ],
)
def test_flags_say_saturated_and_dark(box, currents_a, flags):
    assert flags_of(box, currents_a) == flags


def test_a_saturated_current_is_clipped_at_full_scale(box):
    box.world.currents_a = lambda t_s: [2e-3, *[100e-6] * 7]
    box.wire.handle(start(100))
    data = contents(joined(box.run(0.05)))[-1]
    assert struct.unpack_from("<i", data, 21)[0] == 500_000_000


# --- faults


def test_silence_is_a_step_of_the_count(box):
    box.wire.handle(start(1000))
    before = samples(joined(box.run(0.1)))
    box.bench.verbs["psd.silence"](on=True)
    box.run(0.01)  # what was on the line already
    assert box.ask(documented("PING")) == b""
    assert box.run(0.2) == []
    box.bench.verbs["psd.silence"](on=False)
    after = samples(joined(box.run(0.1)))
    assert after[0][0] > before[-1][0] + 100


def test_damage_spoils_just_one_frame(box):
    box.wire.handle(start(1000))
    box.run(0.1)
    box.bench.verbs["psd.damage"](frames=1)
    parts = [part for part in joined(box.run(0.1)).split(b"\0") if part]
    assert sum(not readable(part) for part in parts) == 1
    assert len(parts) >= 9


def readable(encoded: bytes) -> bool:
    try:
        content = cobs.decode(encoded)
    except cobs.DecodeError:
        return False
    return checksum(content[:-2]) == int.from_bytes(content[-2:], "little")


# --- the whole


def test_the_rig_that_ships_builds_over_the_real_world():
    rig = tomllib.loads((ROOT / "rigs/ur5e-dual-psd.toml").read_text())
    world = World.from_rig(rig)
    bench = build(world, rig)
    port = bench.ports[0]
    assert port.link == rig["devices"]["psd"]["port"]
    port.wire.handle(start(1000))
    sent = b""
    for tick in range(20):
        world.advance((tick + 1) * TICK_S)
        for instrument in bench.instruments:
            instrument.after_step(tick * TICK_S)
        sent += port.wire.due()
    assert [frame[:2] for frame in samples(sent)][:2] == [(0, 1000), (10, 11000)]
