"""What a person sees of a long computation: done and planned, what is being done, time gone and left.

A diagnosis shows its stage: on a terminal one line that is renewed every second, elsewhere a new line every ten
seconds. How long a search takes is known at its end only, so what is left follows from the usual shares of the stages.
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
SAMPLE_S = 0.02  # a sample: the first guess, before any stage has ended
SHARES = {  # of the time of drawn and real sessions; a stage that is not here takes next to none
    Stage.FAULTS: 0.08,
    Stage.GEOMETRY: 0.04,
    Stage.SEARCH: 0.17,
    Stage.UNKNOWN: 0.38,  # 0.1 to 0.7: the more that is found the longer
    Stage.PREDICTION: 0.03,
    Stage.ALTERNATIVES: 0.05,
    Stage.SCATTER: 0.07,
    Stage.SIZES: 0.03,
    Stage.PROOFS: 0.1,
    Stage.FAR_ROWS: 0.05,
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
    """Where a diagnosis is, and how much time is left. Times in seconds of one clock."""

    def __init__(self, begun_s: float, samples: int) -> None:
        self.begun_s = self._stage_begun_s = begun_s
        self._whole_s = SAMPLE_S * samples
        self._stage = Stage.FAULTS

    def enter(self, stage: Stage, now_s: float) -> None:
        """A stage begins: what the ones before it took gives how long all will take."""
        done = _share_before(stage)
        if done > 0.0:
            self._whole_s = (now_s - self.begun_s) / done
        self._stage, self._stage_begun_s = stage, now_s

    def left_s(self, now_s: float) -> float:
        """Never less than what the stages to come usually take: they take longer where this one does."""
        done, gone_s = _share_before(self._stage), now_s - self.begun_s
        behind = done + SHARES.get(self._stage, 0.0)  # as soon as this stage has ended
        whole_s = max(self._whole_s, gone_s / behind) if behind > 0.0 else self._whole_s
        if whole_s > self._whole_s:
            return (1.0 - behind) * whole_s
        return max((1.0 - done) * whole_s - (now_s - self._stage_begun_s), (1.0 - behind) * whole_s, 0.0)

    def text(self, now_s: float) -> str:
        """One line."""
        left_s = self.left_s(now_s)
        left = f"about {_time(left_s)} left" if left_s >= 1.0 else "almost done"
        return f"{self._stage.value}: {_time(now_s - self.begun_s)} gone, {left}"


@contextmanager
def stages_shown(
    console: Console, samples: int, now_s: Callable[[], float] = time.monotonic
) -> Generator[Callable[[Stage], None]]:
    """Gives what a diagnosis calls when a stage begins."""
    outlook = Outlook(now_s(), samples)
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


def _share_before(stage: Stage) -> float:
    order = list(Stage)
    return sum(share for known, share in SHARES.items() if order.index(known) < order.index(stage))


def _time(seconds: float) -> str:
    whole = round(seconds)
    return f"{whole} s" if whole < 120 else f"{round(seconds / 60.0)} min"
