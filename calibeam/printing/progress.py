"""What a person sees of a long computation: done and planned, what is being done, time gone and left.

A diagnosis shows its stage: on a terminal one line that is renewed every second, elsewhere a new line every ten
seconds. How long it takes depends on how much is found, so nothing is stated before the search has ended, and a range
afterwards: that of what recorded diagnoses still took, over what they had taken.
"""

import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from acquisition.wires.streams import in_thread
from calibeam.console import Console
from calibrate.diagnose.stages import Stage

TERMINAL_S, LINE_S = 1.0, 10.0
# Time from the beginning of a stage to the end, over the time before it: half the least and twice the most of sessions
# with a tracker, spots and a wire, with one cause and with several.
REST = {
    Stage.UNKNOWN: (0.25, 10.0),
    Stage.PREDICTION: (0.15, 8.0),
    Stage.SCATTER: (0.15, 3.2),
    Stage.SIZES: (0.06, 1.8),
    Stage.PROOFS: (0.035, 1.2),
    Stage.FAR_ROWS: (0.01, 0.35),
}


def progress_bar(console: Console) -> Progress:
    return Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
    )


class Outlook:
    """Where a diagnosis is, and between which times is left. Times in seconds of one clock."""

    def __init__(self, begun_s: float) -> None:
        self.begun_s = self._known_s = begun_s
        self._stage = Stage.FAULTS
        self._known: Stage | None = None  # the last stage of REST that has begun

    def enter(self, stage: Stage, now_s: float) -> None:
        """A stage begins."""
        self._stage = stage
        if stage in REST and stage is not self._known:
            self._known, self._known_s = stage, now_s

    def left_s(self, now_s: float) -> tuple[float, float] | None:
        """Least and most; None before the search has ended. A stage that takes longer leaves more for those to come."""
        if self._known is None:
            return None
        stages = list(REST)
        behind = [*stages, None][stages.index(self._known) + 1]
        then = (0.0, 0.0) if behind is None else REST[behind]
        before_s, gone_s = self._known_s - self.begun_s, now_s - self.begun_s
        passed_s = now_s - self._known_s
        each = zip(REST[self._known], then, strict=True)
        least_s, most_s = (max(own * before_s - passed_s, next_ * gone_s) for own, next_ in each)
        return least_s, most_s

    def text(self, now_s: float) -> str:
        """One line."""
        left, gone = self.left_s(now_s), f"{self._stage.value}: {_time(now_s - self.begun_s)} gone"
        if left is None:
            return f"{gone}; how much is left shows after the search"
        least, most = _time(left[0]), _time(left[1])
        if left[1] < 1.0:
            return f"{gone}, almost done"
        return f"{gone}, {least} to {most} left" if least != most else f"{gone}, about {most} left"


@contextmanager
def stages_shown(console: Console, now_s: Callable[[], float] = time.monotonic) -> Generator[Callable[[Stage], None]]:
    """Gives what a diagnosis calls when a stage begins."""
    outlook = Outlook(now_s())
    with console.status(outlook.text(now_s())) as status:
        every_s = TERMINAL_S if console.is_terminal else LINE_S

        def show(ended: threading.Event) -> None:
            while not ended.wait(every_s):
                if console.is_terminal:
                    status.update(outlook.text(now_s()))
                else:
                    console.print(outlook.text(now_s()), markup=False, highlight=False)

        with in_thread(show, "progress"):
            yield lambda stage: outlook.enter(stage, now_s())


def _time(seconds: float) -> str:
    whole = round(seconds)
    return f"{whole} s" if whole < 120 else f"{round(seconds / 60.0)} min"
