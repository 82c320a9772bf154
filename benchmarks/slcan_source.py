"""A CAN adapter that only talks: `python -m benchmarks.slcan_source FD COUNT RATE_HZ`, begins when its input ends."""

import os
import struct
import sys
import time


def main(descriptor: int, count: int, rate_hz: float) -> None:
    sys.stdin.buffer.read()
    started_s = time.monotonic()
    for first in range(0, count, 20):
        time.sleep(max(0.0, started_s + first / rate_hz - time.monotonic()))
        numbers = range(first, min(first + 20, count))
        data = b"".join(b"t%03X8%s\r" % (n % 0x7FF, struct.pack("<Q", n).hex().upper().encode()) for n in numbers)
        while data:
            data = data[os.write(descriptor, data) :]
    sys.stdin.close()
    time.sleep(600.0)  # until told to end: a terminal whose far end is closed loses what was not read yet


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]))
