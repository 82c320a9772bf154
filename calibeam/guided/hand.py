"""The emulated hand as a guide: it does what a person would be asked to do, over the side channel."""

from collections.abc import Callable, Mapping
from typing import Any

from numpy import float64
from numpy.typing import NDArray

from acquisition.guided.guide import GuidedProgress, Request
from acquisition.guided.reading import BarEnd, Cone, Target
from calibeam.emulation import EmulationError

Floats = NDArray[float64]


def wish(target: Target, posture_rad: Floats) -> Mapping[str, Any]:
    """What the emulated hand is asked for, in the words of its verb "hand.put"."""
    posture = [float(q) for q in posture_rad]
    if isinstance(target, Cone):
        return {"what": "seat", "id": target.id, "posture_rad": posture}
    if isinstance(target, BarEnd):
        return {"what": "bar", "id": target.position, "end": target.end, "posture_rad": posture}
    return {"what": "sphere", "id": target.id, "direction": list(target.direction), "posture_rad": posture}


Ask = Callable[..., Any]  # verb, arguments by name
CANNOT = "cannot put the probe"  # how simulators/hand/held_arm.py reports that the arm has no such posture


class EmulatedHand:
    """Implements acquisition.guided.guide.Guide; what is reported goes on to `show`."""

    def __init__(self, ask: Ask, show: Callable[[GuidedProgress], None]) -> None:
        self._ask, self._show = ask, show

    def ask(self, request: Request) -> bool:
        try:
            self._ask("hand.put", **wish(request.target, request.posture_rad))
        except EmulationError as refused:
            if CANNOT in str(refused):
                return False
            raise
        return True

    def tell(self, progress: GuidedProgress) -> None:
        self._show(progress)
