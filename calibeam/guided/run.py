"""A whole guided session: connect, guide, record, and conclude."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from rich.console import Console

from acquisition.guided.guide import Guide
from acquisition.guided.plan import GuidedOptions, GuidedVisit, by_kind, calibration_plan, verification_plan
from acquisition.recording.rig import Rig
from calibeam.guided.hand import EmulatedHand
from calibeam.guided.recorded import EncoderAddress, record_guided, watching
from calibeam.guided.view import PersonGuide
from calibeam.recorded import new_recording
from drivers.clock import SystemClock

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
        f"{len(summary.readings)} samples; {summary.slips} rejected as slips, {summary.doubted} in doubt, "
        f"{summary.skipped} left out; recording: {recording}",
        highlight=False,
    )
    if conclude:
        from calibeam.conclude import conclude as concluded  # a second of libraries that no device waits for

        concluded(recording, console)
    else:
        console.print(f"next: calibeam verify {recording} --model model.json", highlight=False, markup=False)
