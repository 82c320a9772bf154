"""Who is at the port when it is not a PSD box: the evidence for the error message."""

from collections.abc import Sequence

from drivers.clock import Clock
from drivers.psd_daq.messages import BadFrame
from drivers.transports.transport import Transport

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
