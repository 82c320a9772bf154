"""The PSD DAQ box as an instrument: who it is, its stream of photocurrents, in SI units.

One thread uses it at a time, except `close`, which any thread may call. It starts no thread of its own. Where something
else is at the port, the error message names what it answers.
"""

from collections.abc import Callable, Sequence
from typing import TypeVar

from drivers.clock import Clock
from drivers.device import Block, Channel, Stamps, StreamDevice
from drivers.errors import DeviceLost, DeviceRefused, DeviceStale, WireError
from drivers.psd_daq.codec import PsdDaqCodec, RepeatFilter, SequenceCount, to_block
from drivers.psd_daq.messages import (
    MAX_RATE_HZ,
    MIN_RATE_HZ,
    Ack,
    BadFrame,
    Identify,
    Identity,
    Message,
    MessageType,
    Nak,
    Request,
    Samples,
    StartStream,
    StopStream,
)
from drivers.transports.transport import Transport

BAUD = 3_000_000  # docs/protocols/psd-daq.md, "The line"
ANSWER_S = 1.0  # a box answers within 20 ms; the rest is for a busy host
WRITE_S = 1.0
READ_BYTES = 65536
BAD_FRAMES_KEPT = 16
Answer = TypeVar("Answer", Identity, Ack)
PROBE_S = 0.3  # a line-oriented instrument echoes or answers an empty line within some 10 ms
EMPTY_LINE = b"\r"  # the only thing sent to a stranger: it moves nothing


def name_stranger(line: Transport, heard: bytes, bad: Sequence[BadFrame], clock: Clock) -> str | None:
    """What answered instead, in words; None when the line stays silent."""
    if bad and "protocol version" in bad[-1].reason:
        return f"it speaks {bad[-1].reason}"
    if heard:
        return f"it sent {_shown(heard)}"
    answer = _probe(line, clock)
    if not answer:
        return None
    return (
        f"it answers an empty line with {_shown(answer)}, as a CAN adapter (slcan) or another line-oriented device does"
    )


def _probe(line: Transport, clock: Clock) -> bytes:
    line.write(EMPTY_LINE, PROBE_S)
    deadline_s = clock.now_s() + PROBE_S
    answer = b""
    while not answer and (left_s := deadline_s - clock.now_s()) > 0.0:
        answer = line.read(32, left_s)
    return answer


def _shown(data: bytes) -> str:
    return f"{data[:32].hex(' ')} ({data[:32]!r})"


class PsdDaq(StreamDevice[Transport]):
    """A `drivers.device.Device`. Channels: photocurrent_a (8,), flags, temperature_degC.

    `open_line` is called by every `connect`, so a box that was unplugged is found again by serial number:
    `PsdDaq(lambda: open_serial(SerialAddress(port="/dev/ttyUSB0"), BAUD), rate_hz=1000.0)`.
    """

    stamps: Stamps = "sampled"

    def __init__(
        self,
        open_line: Callable[[], Transport],
        rate_hz: float = 1000.0,
        *,
        name: str = "psd",
        clock: Clock | None = None,
    ) -> None:
        """ValueError when the rate is not whole hertz from 100 to 4000."""
        if not (MIN_RATE_HZ <= rate_hz <= MAX_RATE_HZ and float(rate_hz).is_integer()):
            raise ValueError(f"{name}: rate_hz {rate_hz!r}; give whole hertz from {MIN_RATE_HZ} to {MAX_RATE_HZ}")
        super().__init__(name, clock)
        self.identity: Identity | None = None
        self.bad_frames: list[BadFrame] = []  # the last BAD_FRAMES_KEPT of this connection
        self.bad_frame_count = 0
        self._open_line = open_line
        self._rate_hz = int(rate_hz)
        self._codec = PsdDaqCodec()
        self._count = SequenceCount()
        self._repeats = RepeatFilter()
        self._pending: list[tuple[float, Samples]] = []  # host time of arrival, samples

    def _open(self) -> Transport:
        return self._open_line()

    def _set_up(self, line: Transport) -> None:
        """Identify the box and start its stream. DeviceLost, DeviceStale (silent), DeviceRefused (another device)."""
        self._codec = PsdDaqCodec()
        self.bad_frames = []
        self.bad_frame_count = 0
        self.identity = self._identify(line)
        self._check_rate(self.identity)
        self._ask(StartStream(self._rate_hz), MessageType.START_STREAM, Ack)
        self._count.restart()

    def _release(self, line: Transport) -> None:
        try:
            line.write(self._codec.encode(StopStream()), WRITE_S)
        except DeviceLost:
            pass  # a box that has gone streams no more
        finally:
            line.close()

    def describe(self) -> tuple[Channel, ...]:
        """Full scale is known once connected."""
        full_scale_a = float("inf") if self.identity is None else self.identity.full_scale_a
        return (
            Channel("photocurrent_a", "A", (8,), full_scale_a, 1e-12),
            Channel("flags", ""),
            Channel("temperature_degC", "degC", (), float("inf"), 0.01),
        )

    def read(self, timeout_s: float) -> Block:
        deadline_s = self._clock.now_s() + timeout_s
        refused_before = self.bad_frame_count
        while not self._pending:
            left_s = self._left_s(deadline_s)
            self._receive(max(left_s, 0.0))  # also at the end: what waits there shows that it was this program
            if left_s <= 0.0 and not self._pending:
                raise self._no_samples(timeout_s, refused_before)
        arrived, self._pending = self._pending, []
        return to_block(arrived, self._count)

    def identify(self) -> Identity:
        """Ask the box again who it is; samples that come in between wait for the next `read`."""
        return self._ask(Identify(), MessageType.IDENTIFY, Identity)

    # --- commands

    def _identify(self, line: Transport) -> Identity:
        """The first exchange on a fresh line: what is heard instead of an identity is evidence of who is there."""
        line.write(b"\0" + self._codec.encode(StopStream()), WRITE_S)  # a delimiter ends what another program left
        heard = bytearray()
        try:
            return self._ask(Identify(), MessageType.IDENTIFY, Identity, heard)
        except DeviceStale as silence:
            stranger = name_stranger(line, bytes(heard), self.bad_frames, self._clock)
            if stranger is not None:
                raise DeviceRefused(
                    f"{self.name}: what is at {line.name} is not a PSD box: {stranger}; "
                    "check that the port in the rig file is the PSD box"
                ) from silence
            raise

    def _check_rate(self, identity: Identity) -> None:
        if not identity.min_rate_hz <= self._rate_hz <= identity.max_rate_hz:
            raise DeviceRefused(
                f"{self.name}: {identity.model} {identity.serial_number} samples at {identity.min_rate_hz} to "
                f"{identity.max_rate_hz} Hz, not at rate_hz {self._rate_hz}; change rate_hz in the rig file"
            )

    def _ask(self, request: Request, kind: MessageType, answer: type[Answer], heard: bytearray | None = None) -> Answer:
        """Send and wait for the answer; samples are kept. DeviceRefused on a NAK, DeviceStale on silence."""
        line = self._opened()
        line.write(self._codec.encode(request), WRITE_S)
        deadline_s = self._clock.now_s() + ANSWER_S
        while (left_s := self._left_s(deadline_s)) > 0.0:
            for message in self._receive(left_s, heard):
                if isinstance(message, answer) and (not isinstance(message, Ack) or message.request == kind):
                    return message
                if isinstance(message, Nak) and message.request == kind:
                    raise DeviceRefused(f"{self.name}: {kind.name} refused, code {message.code}: {message.text}")
        raise DeviceStale(
            f"{self.name}: no answer to {kind.name} within {ANSWER_S:g} s at {line.name}; "
            "check power, cable, and that the port is the PSD box"
        )

    # --- the line

    def _receive(self, timeout_s: float, heard: bytearray | None = None) -> list[Message]:
        """Messages that came, except samples, which are kept for `read`."""
        data = self._opened().read(READ_BYTES, timeout_s)
        if heard is not None:
            heard += data
        host_s = self._clock.now_s()
        others: list[Message] = []
        for message in self._codec.feed(data):
            if isinstance(message, Samples):
                if self._repeats.is_new(message.sequence, len(message.flags)):
                    self._pending.append((host_s, message))
            elif isinstance(message, BadFrame):
                self._note_bad(message)
            else:
                if isinstance(message, Ack) and message.request == MessageType.START_STREAM:
                    self._begin_stream()
                others.append(message)
        return others

    def _begin_stream(self) -> None:
        """What came before the answer is of a stream that another program left running, with a count of its own."""
        self._pending.clear()
        self._repeats = RepeatFilter()

    def _note_bad(self, bad: BadFrame) -> None:
        """One damaged frame shows as a gap of the sequence; only a line with nothing else is an error."""
        self.bad_frame_count += 1
        self.bad_frames = [*self.bad_frames[1 - BAD_FRAMES_KEPT :], bad]

    def _no_samples(self, timeout_s: float, refused_before: int) -> DeviceStale | WireError:
        where = self._opened().name
        damaged = self.bad_frame_count - refused_before
        if damaged:
            last = self.bad_frames[-1]
            return WireError(
                f"{self.name}: {damaged} damaged frames and no sample within {timeout_s:g} s at {where}; the last at "
                f"byte {last.offset}: {last.reason}, {last.first.hex(' ')}; check the cable and that {BAUD} baud is set"
            )
        return DeviceStale(f"{self.name}: no sample within {timeout_s:g} s at {where}; check power and cable")
