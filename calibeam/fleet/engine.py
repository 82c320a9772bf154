"""Spreads orders over workers by joblib: processes of this machine (loky), or a Dask cluster, by joblib's own names.

Rows come as they are ready. A worker that dies breaks a whole round of joblib: the others' rows stay, and what was in
work is ordered again, a few times at most.
"""

import logging
import warnings
from collections import Counter
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager
from importlib.metadata import version
from multiprocessing import TimeoutError as SilenceError  # what joblib raises
from typing import Any

from joblib import Parallel, delayed, parallel_config
from joblib.externals.loky.backend import resource_tracker as loky_tracker

from calibeam.fleet.recordings import Engine, Workers
from calibeam.fleet.row import Order, Row
from calibeam.fleet.supervised import START_S, end_child, run_in_child
from calibeam.worker_processes import without_ctrl_c
from calibrate.errors import DataError

ROUNDS = 3  # in which a worker may die over one recording, before it is given up
# joblib takes whole numbers, too, where its hints have text
ONE_BY_ONE: dict[str, Any] = {"return_as": "generator_unordered", "batch_size": 1, "pre_dispatch": "n_jobs"}
OF_OUR_OWN: dict[str, Any] = {
    "threads_per_worker": 1,
    "processes": True,
    "host": "127.0.0.1",
    "dashboard_address": None,
    "silence_logs": logging.CRITICAL,  # a lost worker is reported in a row
}
WAIT_S = 30.0  # for the first worker of a cluster
MARGIN_S = 60.0  # beyond what any recording may take, for a cluster to start and to move a task
LOST = f"the worker that had it died or stopped answering {ROUNDS} times"
NEEDS_LIMIT = (  # Dask gives up what killed its workers, and joblib is not informed
    "--timeout 0 is not for --engine dask: a file that kills its workers would never end; "
    "give seconds, or take --engine loky"
)


def run_orders(
    orders: Sequence[Order], workers: Workers, work: Callable[[Order], Row] = run_in_child
) -> Generator[Row]:
    """One row an order, as they come. DataError where the engine cannot be had."""
    if workers.engine is Engine.DASK and any(order.timeout_s is None for order in orders):
        raise DataError(NEEDS_LIMIT)
    left = {order.task.path: order for order in orders}
    broken: Counter[str] = Counter()
    try:
        with _backend(workers) as settings:
            while left:
                yield from _rest_of(left, broken, settings, work)
    finally:
        end_child()  # one job is done in this process


def _rest_of(
    left: dict[str, Order], broken: "Counter[str]", settings: dict[str, Any], work: Callable[[Order], Row]
) -> Iterator[Row]:
    """Rows of one round; takes out of `left` what has one, and counts what was in work when the round broke."""
    begun: set[str] = set()
    try:
        for row in _round(list(left.values()), begun, settings, work):
            left.pop(row.path, None)
            yield row
    except (BrokenProcessPool, SilenceError):
        broken.update(path for path in begun if path in left)
        for path in [path for path in left if broken[path] >= ROUNDS]:
            yield left.pop(path).task.lost(LOST)


def _round(
    orders: Iterable[Order], begun: set[str], settings: dict[str, Any], work: Callable[[Order], Row]
) -> Iterator[Row]:
    """Rows of one call of joblib. BrokenProcessPool for a dead worker; SilenceError where nothing comes any more."""
    orders = list(orders)

    def tasks() -> Iterator[Any]:
        for order in orders:
            begun.add(order.task.path)
            yield delayed(work)(order)

    limits = [order.timeout_s for order in orders]
    alone = settings["n_jobs"] == 1  # then joblib works in this process, and has no limit of time
    patience_s = None if alone or None in limits else START_S + MARGIN_S + max(limit or 0.0 for limit in limits)
    with parallel_config(**settings):
        loky_tracker.ensure_running()  # as in without_ctrl_c: joblib has one of its own
        with without_ctrl_c():
            coming: Any = Parallel(timeout=patience_s, **ONE_BY_ONE)(tasks())
        try:
            yield from coming
        finally:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # that rows are left behind when a round ends early: so it is meant
                coming.close()


@contextmanager
def _backend(workers: Workers) -> Generator[dict[str, Any]]:
    """Words of joblib.parallel_config."""
    if workers.engine is Engine.LOKY:
        if workers.scheduler is not None:
            raise DataError(f"--scheduler {workers.scheduler} is for --engine dask; leave it out, or name that engine")
        yield {"backend": "loky", "n_jobs": workers.jobs, "inner_max_num_threads": 1}
        return
    with _client(workers) as client:
        _check(client, workers.scheduler or "the workers of this machine")
        yield {"backend": "dask", "n_jobs": -1, "client": client}


def _check(client: Any, where: str) -> None:
    """Whether workers are there, and are of this version: DataError now rather than silence later."""
    try:
        client.wait_for_workers(1, timeout=WAIT_S)
    except TimeoutError as error:
        raise DataError(f"{where}: no worker came within {WAIT_S:g} s; start some (`dask worker`)") from error
    own = version("calibeam")
    for address, theirs in client.run(version, "calibeam", on_error="return").items():
        if theirs != own:
            raise DataError(f"{where}: worker {address} has calibeam {theirs}, here is {own}; install the same there")


@contextmanager
def _client(workers: Workers) -> Generator[Any]:
    from distributed import Client, LocalCluster

    if workers.scheduler is not None:
        try:
            client = Client(workers.scheduler, set_as_default=False, timeout=10)
        except (OSError, ValueError, TimeoutError) as error:
            raise DataError(
                f"--scheduler {workers.scheduler}: no Dask scheduler answers there ({error}); start one "
                "(`dask scheduler`), or leave --scheduler out for workers on this machine"
            ) from error
        with client:
            yield client
        return
    with ExitStack() as opened:
        with without_ctrl_c():
            cluster = opened.enter_context(LocalCluster(n_workers=workers.jobs, **OF_OUR_OWN))
            client = opened.enter_context(Client(cluster, set_as_default=False))
        yield client
