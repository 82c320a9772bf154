"""A sample of `python -m benchmarks faults`: the cases in which the arm moves, and one of each other phase."""

from collections.abc import Iterator

import numpy as np
import pytest

from benchmarks.device_faults import DEVICES, LIMIT_S, Subject, run, streaming, subjects
from drivers.device import Block, Channel
from drivers.errors import DeviceStale
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


class Stalled:
    """An instrument whose emulator stands still for a while, after it has been connected."""

    name = "encoders"

    def __init__(self) -> None:
        self.connected = 0

    def connect(self) -> None:
        self.connected += 1

    def describe(self) -> tuple[Channel, ...]:
        return ()

    def read(self, timeout_s: float) -> Block:
        if self.connected < 3:
            raise DeviceStale("no encoder answered a SYNC within 0.5 s")
        return Block(np.zeros(1), np.zeros(1), np.zeros(1, dtype=np.int64), {})

    def close(self) -> None: ...


def test_what_a_stalled_emulator_does_before_the_fault_is_no_case() -> None:
    """Else the first read of a stream, which comes before the fault, ends the case on a busy machine."""
    device = Stalled()
    assert len(streaming(device).sequence) == 1
    assert device.connected == 3


@pytest.mark.endure
@pytest.mark.timeout(3600)
@pytest.mark.parametrize(("on_rig", "device"), EACH, indirect=["on_rig"], scope="module")
def test_every_kind_in_every_phase(on_rig: dict[str, Subject], device) -> None:
    outcomes = list(run([on_rig[device]]))
    assert len(outcomes) == 5 * len(KINDS)
    assert [outcome for outcome in outcomes if not outcome.defined] == []
