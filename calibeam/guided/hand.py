"""The emulated hand behind the side channel, as a guide: it does what a person would be asked to do."""

from collections.abc import Callable
from typing import Any

from acquisition.guided.guide import GuidedProgress, Request
from calibeam.emulation import EmulationError
from calibeam.guided.direct import wish

Ask = Callable[..., Any]  # verb, arguments by name
CANNOT = "cannot put the probe"  # how simulators/hand/hand.py says that the arm has no such posture


class EmulatedHand:
    """Implements acquisition.guided.guide.Guide; what is told goes on to `show`."""

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
