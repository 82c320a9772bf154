"""The process that reads recordings for one worker: a task a line on standard input, a row a line on standard output.

Whatever a recording does to it, to crash, to hang, to eat all memory, does it to this process alone. It ends with the
worker (end of input, even in the middle of a task), and when nothing was asked for a while.
"""

import faulthandler
import os
import queue
import sys
import threading

import msgspec

from calibeam.fleet.judge import judged
from calibeam.fleet.order import Task

IDLE_S = 120.0  # a Dask cluster stays up after a run: nothing of ours shall
READY = b"ready\n"


def main() -> None:
    """Answer until the input ends."""
    answers = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # whatever a library prints is no answer
    faulthandler.enable()
    tasks: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(tasks,), daemon=True).start()
    answers.write(READY)
    while True:
        try:
            line = tasks.get(timeout=IDLE_S)
        except queue.Empty:
            return
        row = judged(msgspec.json.decode(line, type=Task))
        answers.write(msgspec.json.encode(row) + b"\n")


def _listen(tasks: "queue.SimpleQueue[bytes]") -> None:
    for line in sys.stdin.buffer:
        tasks.put(line)
    os._exit(0)  # the worker is gone, and nobody waits for what is being computed


if __name__ == "__main__":
    main()
