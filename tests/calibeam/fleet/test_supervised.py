"""Whatever a recording does to the process that reads it, the worker answers."""

import pytest

from calibeam.fleet.recordings import find_recordings
from calibeam.fleet.row import Order, Outcome, Task
from calibeam.fleet.supervised import Child


@pytest.fixture
def ask(folder, reader):
    """Asks one process for these files, in turn."""
    child = Child(reader)

    def rows(*names, timeout_s=30.0):
        found = {one.name: one for one in find_recordings(folder(*names), folder())}
        return [
            child.ask(Order(Task.of(found[name], diagnose=False), 0.2 if "hangs" in name else timeout_s, reader))
            for name in names
        ]

    yield rows
    child.close()


def test_one_process_reads_many_recordings(ask):
    first, second = ask("a.mcap", "b.mcap")
    assert (first.outcome, second.outcome) == (Outcome.IDENTIFIED, Outcome.IDENTIFIED)
    assert first.rig == second.rig  # the reader says its process there


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("exits.mcap", "with code 7 (about to go)"),
        ("killed.mcap", "SIGKILL; most often memory was short"),
        ("hangs.mcap", "not done after 0.2 s; give a longer --timeout"),
        ("babbles.mcap", "JSON is malformed"),
    ],
)
def test_a_process_that_is_lost_becomes_a_row_and_the_next_recording_is_read(ask, name, why):
    lost, after = ask(name, "z.mcap")
    assert lost.outcome is Outcome.LOST
    assert why in lost.error
    assert lost.sha256
    assert after.outcome is Outcome.IDENTIFIED


def test_a_program_that_does_not_start_is_reported(folder, tmp_path):
    (one,) = find_recordings(folder("a.mcap"), tmp_path)
    order = Order(Task.of(one, diagnose=False), None, (str(tmp_path / "none"),))
    child = Child(order.command)
    row = child.ask(order)
    child.close()
    assert row.outcome is Outcome.LOST
    assert "none" in row.error
