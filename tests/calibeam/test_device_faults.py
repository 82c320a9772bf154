"""A sample of `python -m benchmarks faults`: the cases in which the arm moves, and one of each other phase."""

from contextlib import ExitStack

import pytest

from benchmarks.device_faults import LIMIT_S, Subject, run, subjects
from simulators.faults.injector import KINDS


@pytest.fixture(scope="module")
def found():
    with ExitStack() as cleaning:
        yield {subject.name: subject for subject in subjects(cleaning)}


@pytest.mark.parametrize("device", ["psd", "can", "rtde", "modbus"])
@pytest.mark.parametrize(("kind", "phase"), [("silence", "move"), ("disconnect", "stream"), ("stale", "idle")])
def test_a_fault_ends_in_a_defined_state_in_time(found: dict[str, Subject], device, kind, phase) -> None:
    (outcome,) = run([found[device]], [kind], [phase])
    assert not outcome.ended.startswith("UNDEFINED"), outcome
    assert outcome.took_s < LIMIT_S, outcome


@pytest.mark.endure
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("device", ["psd", "can", "rtde", "modbus"])
def test_every_kind_in_every_phase(found: dict[str, Subject], device) -> None:
    outcomes = list(run([found[device]]))
    assert len(outcomes) == 5 * len(KINDS)
    assert [outcome for outcome in outcomes if not outcome.defined] == []
