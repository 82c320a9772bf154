"""What readers and a session report to the live page: verbs that return at once, from any thread, and never raise."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from acquisition.recording.rig import Rig
from acquisition.wires.psd_view import PsdView
from drivers.device import Block

PAGE_STOP = "STOP was pressed on the live page; see why, then go on with a new session"


@dataclass(frozen=True)
class Progress:
    """Where a session is. `phase`: one or two words for a person; `note`: one sentence about the quality so far."""

    phase: str
    done: int = 0
    total: int | None = None
    left_s: float | None = None  # None: not known yet
    note: str = ""


class Feed(Protocol):
    """Who reports to it need not wait, nor know whether a page is open."""

    def heard(self, device: str, block: Block) -> None:
        """Every block of "psd", "encoders", "robot", from its one reader thread; never changed afterwards."""
        ...

    def lost(self, device: str, why: str) -> None:
        """The device failed; `why` is shown as it is. The next `heard` takes it back."""
        ...

    def sees(self, view: PsdView) -> None:
        """How the detectors' currents become spots; once the box is identified."""
        ...

    def measures(self, rig: Rig) -> None:
        """The rig with the places that a session has added; before any of them is named in `stands`."""
        ...

    def stands(self, placement: int, first_psd: int) -> None:
        """Where the fixture stands, and which face the beam strikes first."""
        ...

    def believes(self, corrections: Mapping[str, float]) -> None:
        """Fitted values by parameter name, of this rig's models: by these the beam is drawn."""
        ...

    def progress(self, progress: Progress) -> None: ...

    def said(self, text: str) -> None:
        """One line for a person."""
        ...

    def stops_by(self, stop: Callable[[], None] | None) -> None:
        """What STOP does; it may raise DeviceError. None: there is no arm yet, or no more."""
        ...


class _Silent:
    """Implements Feed: nobody looks."""

    def heard(self, device: str, block: Block) -> None: ...

    def lost(self, device: str, why: str) -> None: ...

    def sees(self, view: PsdView) -> None: ...

    def measures(self, rig: Rig) -> None: ...

    def stands(self, placement: int, first_psd: int) -> None: ...

    def believes(self, corrections: Mapping[str, float]) -> None: ...

    def progress(self, progress: Progress) -> None: ...

    def said(self, text: str) -> None: ...

    def stops_by(self, stop: Callable[[], None] | None) -> None: ...


SILENT: Feed = _Silent()
