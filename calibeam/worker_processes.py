"""Worker processes of a long computation: Ctrl-C is for the process that started them, which then ends them all."""

import signal
from collections.abc import Generator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context

from calibeam.recorded import uninterrupted


@contextmanager
def without_ctrl_c() -> Generator[None]:
    """Processes and threads started inside never receive SIGINT, from their first instruction on.

    A terminal sends it to every process of a job, and each worker would print a traceback. The blocked signal is
    inherited; one that comes meanwhile is delivered at the end.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def worker_pool(jobs: int) -> Generator[ProcessPoolExecutor]:
    """New interpreters, so many at a time; when the block ends by an exception they are ended in mid-work.

    Submit inside `without_ctrl_c`: that is when they are started.
    """
    others = set(active_children())
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        try:
            yield pool
        except BaseException:
            with uninterrupted():
                for worker in set(active_children()) - others:
                    worker.terminate()
            raise
