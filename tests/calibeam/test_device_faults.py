"""A sample of `python -m benchmarks faults`: the cases in which the arm moves, and one of each other phase."""

from collections.abc import Iterator

import pytest

from benchmarks.device_faults import DEVICES, LIMIT_S, Subject, run, subjects
from simulators.faults.injector import KINDS

EACH = [(rig, device) for rig, devices in DEVICES.items() for device in devices]


@pytest.fixture(scope="module")
def on_rig(request) -> Iterator[dict[str, Subject]]:
    with subjects(request.param) as found:
        yield found


@pytest.mark.parametrize(("kind", "phase"), [("silence", "move"), ("disconnect", "stream"), ("stale", "idle")])
@pytest.mark.parametrize(("on_rig", "device"), EACH, indirect=["on_rig"], scope="module")
def test_a_fault_ends_in_a_defined_state_in_time(on_rig: dict[str, Subject], device, kind, phase) -> None:
    (outcome,) = run([on_rig[device]], [kind], [phase])
    assert not outcome.ended.startswith("UNDEFINED"), outcome
    assert outcome.took_s < LIMIT_S, outcome


@pytest.mark.endure
@pytest.mark.timeout(3600)
@pytest.mark.parametrize(("on_rig", "device"), EACH, indirect=["on_rig"], scope="module")
def test_every_kind_in_every_phase(on_rig: dict[str, Subject], device) -> None:
    outcomes = list(run([on_rig[device]]))
    assert len(outcomes) == 5 * len(KINDS)
    assert [outcome for outcome in outcomes if not outcome.defined] == []
