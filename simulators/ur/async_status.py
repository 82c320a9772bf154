"""The progress word of ur_rtde's control script, output_int_register 2.

Bits 0-14 progress, bit 15 running, bits 16-23 write counter, bits 24-30 operation id, both counting 0..127.
Source: comments of the control script that ur_rtde 1.6.5 uploads, `write_async_progress_register`.
"""

RUNNING = 1 << 15
COUNTER_LIMIT = 127


class AsyncStatus:
    """One word; every change counts up, so that a client sees even an operation that is shorter than its cycle."""

    def __init__(self) -> None:
        self._writes = 0
        self._operation = 0

    def started(self) -> int:
        self._operation = 0 if self._operation == COUNTER_LIMIT else self._operation + 1
        return self._word(RUNNING)

    def progress(self, value: int) -> int:
        """`value`: what the program reports, for a path the index of the leg."""
        return self._word(RUNNING | min(max(value, 0), RUNNING - 1))

    def finished(self) -> int:
        return self._word(0)

    def _word(self, low: int) -> int:
        self._writes = 0 if self._writes == COUNTER_LIMIT else self._writes + 1
        return low | (self._writes << 16) | (self._operation << 24)
