"""Worker processes of a long computation: Ctrl-C is for the process that started them, which then ends them all."""

import signal
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context, resource_tracker
from typing import TypeVar

from calibeam.devices.recorder import uninterrupted

Item = TypeVar("Item")
Result = TypeVar("Result")


@contextmanager
def without_ctrl_c() -> Generator[None]:
    """Processes and threads started inside never receive SIGINT, from their first instruction on.

    A terminal sends it to every process of a job, and each worker would print a traceback. The blocked signal is
    inherited; one that comes meanwhile is delivered at the end.
    """
    resource_tracker.ensure_running()  # who starts it lets SIGINT through afterwards, whatever was blocked before
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def in_workers(work: Callable[[Item], Result], items: Sequence[Item], jobs: int) -> Generator[Result]:
    """Results in the order of the items, from so many new interpreters at a time; what `work` raises is raised here.

    Whoever leaves it before its end, by Ctrl-C too, closes it: the workers are ended in mid-work then.
    """
    others = set(active_children())
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        try:
            with without_ctrl_c():
                # Not `map`: it cancels what is left, and a thread of an executor whose workers die then fails by it.
                coming = [pool.submit(work, item) for item in items]
            for future in coming:
                yield future.result()
        except BaseException:
            with uninterrupted():
                for worker in set(active_children()) - others:
                    worker.terminate()
            raise
