"""All faults of one device: asked for over the side channel, met by its lines and by its cycles.

What it does not imitate: faults on the way to the device; requests always arrive, whole and at once.
"""

from collections.abc import Callable, Mapping
from typing import Any

from simulators.faults.device_faults import STATE_FAULTS, Fault, FaultError, Output, Setting, Target
from simulators.faults.line_faults import LINE_FAULTS

LINE_KINDS = {kind.name: kind for kind in LINE_FAULTS}
STATE_KINDS = {kind.name: kind for kind in STATE_FAULTS}
ERROR = "error"  # the device says no, in the words of its protocol, and does not do what it was asked for
KINDS = (*LINE_KINDS, ERROR, *STATE_KINDS)


class Injector:
    """The faults of a device; an `Instrument` of simulators.wire, so that those with a duration see time pass."""

    def __init__(self, device: str, target: Target) -> None:
        self.name = f"faults of {device}"
        self.device = device
        self._target = target
        self._faults: list[Fault] = []
        self._now_s = 0.0

    @property
    def quiet(self) -> bool:
        """No fault is active."""
        return not self._faults

    # --- side channel

    def inject(self, kind: str, count: int | None, every: int, port: str | None, settings: Mapping[str, Any]) -> None:
        """FaultError for a kind or setting that there is not, and for a device that cannot have this fault."""
        if kind not in KINDS:
            raise FaultError(f"no fault {kind!r}; there are {', '.join(KINDS)}")
        if (count is not None and count < 1) or every < 1:
            raise FaultError(f"{kind}: count {count}, every {every}; give whole numbers from 1 on, or no count")
        known = {**LINE_KINDS, **STATE_KINDS}[kind].settings if kind != ERROR else {}
        fault = Fault(kind, _checked(kind, settings, known), count, every, port)
        if kind in STATE_KINDS:
            STATE_KINDS[kind].begin(self._target, fault, self._now_s)
        self._faults.append(fault)

    def clear(self) -> None:
        """Everything is well again."""
        for fault in self._faults:
            self._end(fault)
        self._faults.clear()

    def listed(self) -> list[dict[str, Any]]:
        return [
            {"device": self.device, "kind": fault.kind, "struck": fault.struck, "left": fault.left}
            for fault in self._faults
        ]

    # --- what is disturbed

    def refuse(self, request: bytes, refusal: Callable[[bytes], bytes | None], port: str) -> bytes | None:
        """The error reply to a request that must not reach the device; None when it shall."""
        for fault in self._faults:
            if fault.kind != ERROR or fault.port not in (None, port) or fault.spent:
                continue
            reply = refusal(request)
            if reply is not None and fault.turn():
                fault.strike()
                self._faults = [fault for fault in self._faults if not fault.spent]
                return reply
        return None

    def disturb(self, output: Output, port: str) -> None:
        """Lets every fault that is due have the output, in the order in which they were injected."""
        for fault in self._faults:
            kind = LINE_KINDS.get(fault.kind)
            if kind is None or fault.port not in (None, port) or not output.parts or not fault.turn():
                continue
            if kind.strike(output, fault, self._target):
                fault.strike()
        self._faults = [fault for fault in self._faults if not fault.spent]

    def before_step(self, t_s: float) -> None:
        """Faults that last: one cycle less."""
        self._now_s = t_s
        if not self._faults:
            return
        for fault in self._faults:
            if fault.kind in STATE_KINDS:
                fault.strike()
                if fault.spent:
                    self._end(fault)
        self._faults = [fault for fault in self._faults if not fault.spent]

    def after_step(self, t_s: float) -> None:
        """Nothing to do."""

    def _end(self, fault: Fault) -> None:
        if fault.kind in STATE_KINDS:
            STATE_KINDS[fault.kind].end(self._target, fault)


def _checked(kind: str, given: Mapping[str, Any], known: Mapping[str, Setting]) -> dict[str, float]:
    values = {name: setting.otherwise for name, setting in known.items()}
    for name, value in given.items():
        setting = known.get(name)
        if setting is None:
            raise FaultError(f"{kind}: no setting {name!r}; there are {', '.join(known) or 'none'}")
        if isinstance(value, bool) or not isinstance(value, int | float) or not setting.least <= value <= setting.most:
            raise FaultError(f"{kind}: {name} = {value!r}; give a number from {setting.least:g} to {setting.most:g}")
        values[name] = float(value)
    return values
