"""Bytes for a client that reads slowly, or never."""

from simulators.host.line import ANSWER_LIMIT_BYTES, STREAM_LIMIT_BYTES, Outbox


class Pipe:
    """Takes as many bytes as there is room."""

    def __init__(self, room: int) -> None:
        self.room = room
        self.taken = b""

    def write(self, data: bytes) -> int:
        if self.room == 0:
            raise BlockingIOError
        part = data[: self.room]
        self.room -= len(part)
        self.taken += part
        return len(part)


def test_what_does_not_fit_follows_in_order():
    pipe = Pipe(3)
    outbox = Outbox(pipe.write)
    outbox.stream(b"abcdef")
    outbox.stream(b"ghi")
    assert (pipe.taken, outbox.empty) == (b"abc", False)
    pipe.room = 100
    outbox.flush()
    assert (pipe.taken, outbox.empty) == (b"abcdefghi", True)


def test_streamed_outputs_are_dropped_whole_when_too_much_waits():
    pipe = Pipe(0)
    outbox = Outbox(pipe.write)
    package = bytes(1000)
    for _ in range(100):
        outbox.stream(package)
    kept = STREAM_LIMIT_BYTES // 1000 + 1
    assert outbox.dropped == 100 - kept
    pipe.room = 10**6
    outbox.flush()
    assert len(pipe.taken) == 1000 * kept
    outbox.stream(b"next")
    assert pipe.taken.endswith(b"next")


def test_at_eight_times_the_pace_a_client_may_stand_still_as_long():
    plain, fast = Outbox(Pipe(0).write), Outbox(Pipe(0).write, pace=8.0)
    package = bytes(1000)
    for _ in range(60):
        plain.stream(package)
        for _ in range(8):
            fast.stream(package)
    assert plain.dropped == fast.dropped == 0
    for _ in range(10):
        plain.stream(package)
        for _ in range(8):
            fast.stream(package)
    assert plain.dropped > 0
    assert fast.dropped > 0


def test_answers_are_kept_when_the_stream_is_not_and_refused_in_the_end():
    outbox = Outbox(Pipe(0).write)
    outbox.stream(bytes(STREAM_LIMIT_BYTES + 1))
    assert outbox.answer(b"yes")
    assert outbox.answer(bytes(ANSWER_LIMIT_BYTES))
    assert not outbox.answer(b"one too many")


def test_while_too_much_waits_nothing_need_be_made_for_the_stream():
    pipe = Pipe(0)
    outbox = Outbox(pipe.write)
    assert outbox.takes_stream()
    outbox.stream(bytes(STREAM_LIMIT_BYTES + 1))
    assert not outbox.takes_stream()
    assert outbox.dropped == 1
    pipe.room = STREAM_LIMIT_BYTES + 1
    assert outbox.takes_stream()
