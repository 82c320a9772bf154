"""A 32-bit sequence number that wraps and starts anew, as one that only rises."""

WRAP = 1 << 32


class SequenceCount:
    """Unwraps the box's count. After `restart` (a new stream) the count goes on behind a gap of at least one sample."""

    def __init__(self) -> None:
        self._next = 0  # rising number of the next sample, when none is lost
        self._shift = 0  # rising minus raw number, of the present stream

    def restart(self) -> None:
        """The box counts from zero again; whatever it says next is behind all that was before."""
        if self._next > 0:
            self._next += 1  # what passed between the streams is not known to be nothing
        self._shift = self._next

    def unwrap(self, raw: int, count: int) -> int:
        """The rising number of a frame's first sample, `count` samples long."""
        while raw + self._shift < self._next - WRAP // 2:
            self._shift += WRAP
        rising = raw + self._shift
        self._next = rising + count
        return rising


class RepeatFilter:
    """Finds frames of one stream that came before: their samples must not count twice."""

    def __init__(self) -> None:
        self._next: int | None = None

    def is_new(self, raw: int, count: int) -> bool:
        """Whether the frame with this first sample, `count` samples long, begins behind all that were new."""
        if self._next is not None and (raw - self._next) % WRAP >= WRAP // 2:
            return False
        self._next = (raw + count) % WRAP
        return True
