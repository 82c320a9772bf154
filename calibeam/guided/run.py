"""A whole guided session: connect, guide, record, write the results.

A person at the arm sees where to put the probe next, each joint's way, coverage, and repeatability so far.
"""

from collections.abc import Callable, Generator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from acquisition.guided.plan import GuidedOptions, GuidedVisit, by_kind, calibration_plan, verification_plan
from acquisition.guided.reading import BarEnd, Cone, Guide, GuidedProgress, Request, Target
from acquisition.recording.rig import Rig
from calibeam.console import Console
from calibeam.devices.recorder import new_recording
from calibeam.emulation import EmulationError
from calibeam.guided.recorded import EncoderAddress, record_guided, watching
from calibeam.site_log import SESSION_LOG, SITE_LOG
from drivers.clock import SystemClock

CLOSE_RAD = 0.35  # a joint this near the wanted posture is good: nobody copies a picture better
REFRESH_HZ = 5.0


class PersonGuide:
    """Implements acquisition.guided.reading.Guide for a person who reads the terminal; it waits for nobody's key."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._live: Live | None = None
        self._said: str | None = None

    @contextmanager
    def open(self) -> Generator[None]:
        """The view stays in one place inside."""
        with Live(console=self._console, refresh_per_second=REFRESH_HZ, transient=True) as live:
            self._live = live
            try:
                yield
            finally:
                self._live = None

    def ask(self, request: Request) -> bool:
        again = "" if request.attempt == 1 else f" again ({request.attempt}), lift it out first"
        text = f"put the probe on {request.target.says}{again}"
        if text != self._said:
            self._console.print(text, highlight=False, markup=False)
            self._said = text
        return True

    def tell(self, progress: GuidedProgress) -> None:
        if self._live is not None:
            self._live.update(drawn(progress))


def drawn(progress: GuidedProgress) -> Group:
    """The whole view."""
    return Group(_head(progress), _joints(progress))


def _head(progress: GuidedProgress) -> Text:
    text = Text(f"{progress.done} of {progress.planned} readings; {progress.request.target.says}: ")
    text.append(progress.says, style="bold green" if progress.says.startswith("taken") else "bold")
    if progress.repeatability_m is not None:
        text.append(f"; the probe repeats to {1e6 * progress.repeatability_m:.1f} µm so far")
    return text


def _joints(progress: GuidedProgress) -> Table:
    table = Table("joint", "now", "wanted", "", "range visited", box=None)
    each = zip(progress.q_rad, progress.request.posture_rad, strict=True)
    for joint, (now_rad, wanted_rad) in enumerate(each):
        table.add_row(
            str(joint + 1),
            f"{np.degrees(now_rad):+z.0f}°",
            f"{np.degrees(wanted_rad):+z.0f}°",
            _way(now_rad, wanted_rad),
            progress.coverage.marks(joint),
        )
    return table


def _way(now_rad: float, wanted_rad: float) -> str:
    left_rad = wanted_rad - now_rad
    if not np.isfinite(left_rad) or abs(left_rad) <= CLOSE_RAD:
        return "good"
    arrow = "→" if left_rad > 0.0 else "←"
    return arrow * min(3, 1 + int(abs(left_rad) / np.radians(45.0)))


def wish(target: Target, posture_rad: NDArray[np.float64]) -> Mapping[str, Any]:
    """What the emulated hand is asked for, in the words of its verb "hand.put"."""
    posture = [float(q) for q in posture_rad]
    if isinstance(target, Cone):
        return {"what": "seat", "id": target.id, "posture_rad": posture}
    if isinstance(target, BarEnd):
        return {"what": "bar", "id": target.position, "end": target.end, "posture_rad": posture}
    return {"what": "sphere", "id": target.id, "direction": list(target.direction), "posture_rad": posture}


CANNOT = "cannot put the probe"  # how simulators/hand/held_arm.py reports that the arm has no such posture


class EmulatedHand:
    """Implements acquisition.guided.reading.Guide; what is reported goes on to `show`."""

    def __init__(self, ask: Callable[..., Any], show: Callable[[GuidedProgress], None]) -> None:
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


HAND_PATIENCE_S = 30.0  # of emulated time: the longest reach takes 8 s


def plan_of(rig: Rig, options: GuidedOptions, *, verify: bool) -> tuple[GuidedVisit, ...]:
    """What is taken. AcquisitionError where the rig has not what it takes."""
    return verification_plan(rig) if verify else calibration_plan(rig, options)


def run_guided(
    rig: Rig,
    rig_text: str,
    out: Path,
    address: EncoderAddress,
    plan: tuple[GuidedVisit, ...],
    console: Console,
    *,
    seed: int = 1,
    ask: Callable[..., Any] | None = None,
    conclude: bool = True,
) -> None:
    """Record the plan into `out`; `ask` moves an emulated hand, else a person is guided. `conclude`: identify, too."""
    clock, recording = SystemClock(), out / "recording.mcap"
    out.mkdir(parents=True, exist_ok=True)
    SITE_LOG.begin(out / SESSION_LOG)
    person = PersonGuide(console)
    guide: Guide = person if ask is None else EmulatedHand(ask, person.tell)
    opened: AbstractContextManager[None] = person.open() if console.is_terminal else nullcontext()
    counts = ", ".join(f"{count} of {kind}" for kind, count in by_kind(plan).items() if count)
    console.print(f"guided session: {counts}; a reading is taken when the probe is still", highlight=False)
    with (
        new_recording(recording, rig_text, clock, {"plan_seed": str(seed)}) as writer,
        watching(address, writer, clock) as watch,
        opened,
    ):
        summary = record_guided(
            watch,
            rig,
            guide,
            plan,
            writer,
            clock,
            seed=seed,
            **({} if ask is None else {"patience_s": HAND_PATIENCE_S}),
        )
    console.print(
        f"samples: {len(summary.readings)}, rejected as slips: {summary.slips}, uncertain: {summary.doubted}, "
        f"left out: {summary.skipped}; recording: {recording}",
        highlight=False,
    )
    if conclude:
        from calibeam.results.session_results import (
            write_session_results as concluded,  # a second of libraries that no device waits for
        )

        concluded(recording, console)
    else:
        console.print(f"next: calibeam verify {recording} --model model.json", highlight=False, markup=False)
