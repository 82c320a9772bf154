"""A whole session with a tracker: devices, plan, arm, measure, results.

Without a plan poses are drawn evenly over the joints' ranges, ordered by short ways, some of them repeated.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import Progress as Bar

from acquisition.recording import Event, RecordingWriter, RigFileError
from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan
from acquisition.recording.rig import Rig
from acquisition.session.tracked import TrackedOptions, TrackedSession, TrackedSummary, check_tracked_plan
from acquisition.wires.tracker_bench import TrackerBench
from calibeam.asking import YES, Asking, someone
from calibeam.devices.check import check_devices
from calibeam.devices.recorder import RecordingJournal, kept, new_recording
from calibeam.devices.site import TrackerAddresses, connected_tracker
from calibeam.live.feed import SILENT, Feed, Progress
from calibeam.motion.reachable_poses import candidates_of, way_is_clear
from calibeam.printing.progress import progress_bar
from calibrate.arms.rig_arm import RigArm
from drivers.clock import Clock, SystemClock
from drivers.errors import DeviceRefused

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class TrackedJob:
    """From the command line. `plan` None: `poses` are drawn by `seed`."""

    rig: Rig
    text: str  # of the rig file
    out: Path
    addresses: TrackerAddresses
    plan: PosePlan | None = None
    poses: int = 40
    seed: int = 1


def run_tracked(job: TrackedJob, console: Console, feed: Feed = SILENT, *, asking: Asking | None, agrees: bool) -> None:
    """The whole session; recording, model, diagnosis and report in `job.out`. PartialResult when it ended early.

    `asking`: the terminal at which a person sits; `agrees`: who needs not be asked whether the arm may move.
    """
    if job.plan is not None:
        check_tracked_plan(job.plan)
    clock, path = SystemClock(), job.out / "recording.mcap"
    if job.addresses.hurry == 1.0:
        _check(job.rig, console, clock)
    plan = drawn_plan(job.rig, job.poses, job.seed) if job.plan is None else job.plan
    console.print(f"session with a tracker: {plan.poses} readings, repeats among them", highlight=False)
    if not agrees:
        someone(asking, "whether the arm may move", YES).may_move()
    job.out.mkdir(parents=True, exist_ok=True)
    with (
        new_recording(path, job.text, clock, {"plan_seed": str(job.seed)}) as writer,
        connected_tracker(job.rig, job.addresses, writer, clock, feed) as bench,
    ):
        summary = record_tracked(bench, job.rig, writer, plan, clock, progress_bar(console), feed=feed)
    console.print(f"{len(summary.samples)} samples, {summary.skipped} skipped; recording: {path}", highlight=False)
    from calibeam.results.session_results import (
        write_session_results,  # a second of libraries that no device waits for
    )

    write_session_results(path, console)


def record_tracked(
    bench: TrackerBench,
    rig: Rig,
    writer: RecordingWriter,
    plan: PosePlan,
    clock: Clock,
    bar: Bar,
    options: TrackedOptions | None = None,
    feed: Feed = SILENT,
) -> TrackedSummary:
    """Take the poses of a plan. PartialResult when it ended early: the arm stands, samples are kept."""
    with bar:
        task = bar.add_task("measuring", total=plan.poses)

        def tell(done: int, total: int) -> None:
            bar.update(task, completed=done)
            feed.progress(Progress("measure", done, total))

        journal, home_rad = RecordingJournal(writer, clock), np.array(rig.motion.home_rad)
        session = TrackedSession(bench, journal, options or TrackedOptions(), home_rad, nominal_target(rig), tell=tell)
        summary = kept(bench, writer, clock, session, lambda: session.run(plan))
    writer.event(Event(clock.now_s(), "end", {"samples": len(summary.samples), "skipped": summary.skipped}))
    return summary


def nominal_target(rig: Rig) -> Callable[[Floats], Floats]:
    """Positions (pose, 3) of the target in the base at readings (pose, joint), by the nominal arm."""
    arm, point_m = RigArm.of_rig(rig), np.array(rig.tool.point_m)

    def at(q_rad: Floats) -> Floats:
        flange = arm.frames(q_rad)[:, -1]
        return flange[:, :3, :3] @ point_m + flange[:, :3, 3]

    return at


def _check(rig: Rig, console: Console, clock: Clock) -> None:
    """One line a device; DeviceRefused where one is not fit for a session."""
    checks = list(check_devices(rig, clock))
    for check in checks:
        console.print(check.line, highlight=False, markup=False, soft_wrap=True)
    if wrong := [check.line for check in checks if check.wrong]:
        raise DeviceRefused("; ".join(wrong))


SPARE = 3  # candidates for each pose that is wanted: of many the next one is near
PER_CANDIDATE = 6  # `candidates_of` draws so many for each that it is asked for
REPEATED_EVERY = 8  # poses: one of so many is taken twice more, each joint from either side


def drawn_plan(rig: Rig, poses: int, seed: int) -> PosePlan:
    """A plan of so many poses and their repeats, each the nearest one by a clear way from the one before.

    RigFileError where fewer can be reached.
    """
    if rig.device is None:
        raise RigFileError(
            f"rig {rig.name}: no [device]; poses are drawn for an instrument that stands somewhere, so give roughly "
            "where, or give a --plan"
        )
    rng = np.random.default_rng(seed)
    left = list(candidates_of(rig, -(-SPARE * poses // PER_CANDIDATE), rng).q_rad)
    at, chosen = np.array(rig.motion.home_rad), list[Floats]()
    while left and len(chosen) < poses:
        left.sort(key=lambda q: float(np.max(np.abs(q - at))))
        near = next((k for k, q in enumerate(left) if way_is_clear(rig, at, q)), None)
        if near is None:
            break
        at = left.pop(near)
        chosen.append(at)
    if len(chosen) < poses:
        raise RigFileError(
            f"rig {rig.name}: {len(chosen)} of {poses} poses are reached by clear ways from home; ask for fewer, or "
            "check home_rad and the boxes of [motion]"
        )
    return PosePlan(1, rig.name, (PlannedBlock(tuple(_with_repeats(chosen))),))


def _with_repeats(chosen: list[Floats]) -> list[PlannedPose]:
    out: list[PlannedPose] = []
    for number, q in enumerate(chosen):
        values = tuple(map(float, q))
        if number % REPEATED_EVERY != 0:
            out.append(PlannedPose(values))
            continue
        group = 1 + number // REPEATED_EVERY
        out += [PlannedPose(values, (way,) * len(values), repeat=group) for way in (1, -1, 1)]
    return out
