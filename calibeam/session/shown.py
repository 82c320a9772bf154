"""What is known of a running session at this moment, and who is told of it."""

from dataclasses import dataclass
from typing import Protocol

from acquisition.progress import Progress
from acquisition.session_states import RunState
from calibeam.session.forecast import Forecast
from calibeam.session.quality import Quality

UNDELIVERED = "stop not delivered, press the red emergency stop"


@dataclass(frozen=True)
class Shown:
    """None: nothing to say yet."""

    state: RunState = RunState.IDLE
    step: str = ""  # "4 of 7  measure"
    progress: Progress | None = None
    left_s: float | None = None
    quality: Quality | None = None
    forecast: Forecast | None = None
    asked: str = ""  # what a person is waited for
    undelivered: str = ""  # why the arm could not be told to stop

    @property
    def head(self) -> str:
        """What is going on, in a word or two."""
        if self.undelivered:
            return UNDELIVERED
        if self.asked:
            return "your turn"
        if self.state is RunState.RUNNING and self.progress is not None:
            return self.progress.phase.value
        return self.state.value


class Listener(Protocol):
    """Terminal, log file or page. Told from several threads, one at a time; never raises."""

    def said(self, text: str, loud: bool) -> None:
        """One line; those that are not loud are for the log."""
        ...

    def shows(self, shown: Shown) -> None:
        """At every change."""
        ...
