"""Worker processes that are killed in the middle of a run, on both engines: every recording gets its row."""

from collections.abc import Iterator
from dataclasses import replace

import pytest

from calibeam.fleet.engine import LOST, run_orders
from calibeam.fleet.recordings import Engine, Workers, find_recordings
from calibeam.fleet.row import Order, Outcome, Row, Task
from calibrate.errors import DataError

NAMES = [f"{letter}.mcap" for letter in "abcdefgh"]


@pytest.fixture
def orders(folder, reader, tmp_path):
    def make(*names: str) -> list[Order]:
        return [Order(Task.of(one, diagnose=False), 30.0, reader) for one in find_recordings(folder(*names), tmp_path)]

    return make


def outcomes(found: Iterator[Row]) -> dict[str, Outcome]:
    listed = list(found)
    assert len(listed) == len({row.name for row in listed}), "a recording has two rows"
    return {row.name: row.outcome for row in listed}


def test_loky_goes_on_when_a_worker_is_killed(orders):
    names = [*NAMES, "d worker.mcap"]
    found = outcomes(run_orders(orders(*names), Workers(Engine.LOKY, 2)))
    assert found == dict.fromkeys(names, Outcome.IDENTIFIED)


def test_a_dask_scheduler_goes_on_when_one_of_its_two_workers_is_killed(orders):
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, silence_logs=50
    ) as cluster:
        names = [*NAMES, "d worker.mcap"]
        found = outcomes(run_orders(orders(*names), Workers(Engine.DASK, scheduler=cluster.scheduler_address)))
    assert found == dict.fromkeys(names, Outcome.IDENTIFIED)


def test_what_kills_its_worker_each_time_is_given_up(orders, monkeypatch):
    """A round that breaks is joblib's word for a dead worker; here it breaks whenever one recording is in work."""
    from concurrent.futures.process import BrokenProcessPool

    def breaking(listed, begun, settings, work):
        for order in listed:
            begun.add(order.task.path)
            if "bad" in order.task.name:
                raise BrokenProcessPool
            yield work(order)

    monkeypatch.setattr("calibeam.fleet.engine._round", breaking)
    done = {row.name: row for row in run_orders(orders("a.mcap", "bad.mcap", "c.mcap"), Workers(jobs=1))}
    assert [done[name].outcome for name in ("a.mcap", "bad.mcap", "c.mcap")] == [
        Outcome.IDENTIFIED,
        Outcome.LOST,
        Outcome.IDENTIFIED,
    ]
    assert done["bad.mcap"].error == LOST


def test_workers_that_fall_silent_are_not_waited_for(orders, monkeypatch):
    monkeypatch.setattr("calibeam.fleet.engine.START_S", 0.0)
    monkeypatch.setattr("calibeam.fleet.engine.MARGIN_S", 0.2)
    monkeypatch.setattr("calibeam.fleet.engine.ROUNDS", 1)
    silent = [
        Order(order.task, 0.0, ("cat",)) for order in orders("a.mcap", "b.mcap")
    ]  # it never says that it is ready
    found = list(run_orders(silent, Workers(Engine.LOKY, 2)))
    assert [(row.outcome, row.error) for row in found] == [(Outcome.LOST, LOST)] * 2


def test_dask_is_not_waited_for_without_end(orders):
    unlimited = [replace(order, timeout_s=None) for order in orders("a.mcap")]
    with pytest.raises(DataError, match="--timeout 0 is not for --engine dask"):
        next(run_orders(unlimited, Workers(Engine.DASK)))


def test_a_scheduler_belongs_to_dask_and_has_to_answer(orders):
    with pytest.raises(DataError, match="for --engine dask"):
        next(run_orders(orders("a.mcap"), Workers(scheduler="tcp://127.0.0.1:1")))
    with pytest.raises(DataError, match="no Dask scheduler answers"):
        next(run_orders(orders("a.mcap"), Workers(Engine.DASK, scheduler="nonsense://127.0.0.1:1")))
