"""Faults of what a device sends. Each changes one output, and says whether it did; `error` is in injector.py.

An output is what a device sends in one go: at least one frame, reply or line of its protocol.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from simulators.faults.device_faults import MOST_JUNK_BYTES, Fault, Output, Setting, Target
from simulators.wire import TICK_S

Strike = Callable[[Output, Fault, Target], bool]


@dataclass(frozen=True)
class LineFault:
    """A kind. `strike` returns False when the output is none that it can spoil, and leaves it alone."""

    name: str
    strike: Strike
    settings: Mapping[str, Setting] = field(default_factory=dict[str, Setting])


def _delay(output: Output, fault: Fault, target: Target) -> bool:
    ticks = max(1, round(fault.settings["seconds"] / TICK_S))
    output.parts = [(held + ticks, part) for held, part in output.parts]
    return True


def _split(output: Output, fault: Fault, target: Target) -> bool:
    """The second part comes a while later."""
    data = output.data
    if len(data) < 2:
        return False
    held, at = output.parts[0][0], 1 + int(target.rng.integers(len(data) - 1))
    ticks = max(1, round(fault.settings["seconds"] / TICK_S))
    output.parts = [(held, data[:at]), (held + ticks, data[at:])]
    return True


def _junk(output: Output, fault: Fault, target: Target) -> bool:
    """Random bytes before the output."""
    output.replace(target.rng.bytes(int(fault.settings["bytes"])) + output.data)
    return True


def _checksum(output: Output, fault: Fault, target: Target) -> bool:
    output.replace(output.damaged(output.data))
    return True


def _nth_only(output: Output, fault: Fault, target: Target) -> bool:
    """Only every n-th output comes."""
    if fault.seen % int(fault.settings["n"]) != 0:
        output.parts = []
    return True


def _silence(output: Output, fault: Fault, target: Target) -> bool:
    output.parts = []
    return True


def _disconnect(output: Output, fault: Fault, target: Target) -> bool:
    output.parts, output.hang_up = [], True
    return True


def _stale(output: Output, fault: Fault, target: Target) -> bool:
    """What was sent before, once more, instead of something new."""
    if not output.before:
        return False
    output.replace(output.before)
    return True


def _duplicate(output: Output, fault: Fault, target: Target) -> bool:
    output.replace(2 * output.data)
    return True


LINE_FAULTS = (
    LineFault("delay", _delay, {"seconds": Setting(0.1, TICK_S, 60.0)}),
    LineFault("split", _split, {"seconds": Setting(0.01, TICK_S, 60.0)}),
    LineFault("junk", _junk, {"bytes": Setting(16, 1, MOST_JUNK_BYTES)}),
    LineFault("checksum", _checksum),
    LineFault("nth-only", _nth_only, {"n": Setting(3, 2, 1e6)}),
    LineFault("silence", _silence),
    LineFault("disconnect", _disconnect),
    LineFault("stale", _stale),
    LineFault("duplicate", _duplicate),
)
