"""Six encoders behind a serial-line CAN adapter, and no world: what a logger of encoders is measured against.

`python -m benchmarks.encoder_bus` prints the adapter's path and serves until its standard input ends.
"""

import sys

import numpy as np

from simulators.encoders.emulator import build
from simulators.host.loop import Host

NODES = [1, 2, 3, 4, 5, 6]


class Shafts:
    """Six shafts that turn slowly, each at its own speed."""

    def __init__(self) -> None:
        self.time_s = 0.0

    def advance(self, until_s: float) -> None:
        self.time_s = until_s

    def link_encoders_rad(self) -> np.ndarray:
        return np.arange(1, 7) * 0.1 * self.time_s


def serve() -> None:
    world = Shafts()
    bench = build(world, {"devices": {"encoders": {"nodes": NODES, "bitrate": 1_000_000, "channel": ""}}})
    host = Host(bench, world)
    ended: list[bool] = []

    def read() -> None:
        if not sys.stdin.buffer.read1(1):
            ended.append(True)

    host.watch(sys.stdin.fileno(), read)
    print(host.serial_address("can"), flush=True)
    host.run(lambda: bool(ended))
    host.close()


if __name__ == "__main__":
    serve()
