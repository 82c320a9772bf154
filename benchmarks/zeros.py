"""Do stated sigmas of joint zeros keep their word? Whole sessions on many concealed truths, every zero printed."""

import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from acquisition.recording import RecordingWriter, read
from acquisition.recording.rig import Rig
from acquisition.session.plan import PlanOptions
from acquisition.session.session import Session
from calibeam.commands.demo import ZeroAgainstTruth, compare_with_truth
from calibeam.devices.recorder import RecordingJournal
from calibeam.learner import FittedLearner
from calibeam.results.identification import identify_session
from calibeam.software import SOFTWARE
from drivers.clock import SystemClock
from simulators.world.truth import write_truth
from tests.support.direct_bench import direct_bench


@dataclass(frozen=True)
class SeedResult:
    """One session against its truth."""

    seed: int
    samples: int
    skipped: int
    revealed: tuple[ZeroAgainstTruth, ...]


def run(rig: Rig, plain_rig: Mapping[str, Any], rig_text: str, seeds: range) -> Iterator[SeedResult]:
    """One in-process session a seed: recorded to a file, read back, identified, and only then compared."""
    for seed in seeds:
        with tempfile.TemporaryDirectory() as folder:
            yield _one(rig, plain_rig, rig_text, seed, Path(folder))


def _one(rig: Rig, plain_rig: Mapping[str, Any], rig_text: str, seed: int, folder: Path) -> SeedResult:
    bench, clock = direct_bench(rig, plain_rig, seed=seed), SystemClock()
    write_truth(bench.world.truth, folder / "truth.json")
    with RecordingWriter(folder / "r.mcap", rig_text=rig_text, software=SOFTWARE, clock=clock) as writer:
        journal = RecordingJournal(writer, clock)
        home_rad = np.array(rig.motion.home_rad)
        session = Session(bench, FittedLearner(rig), journal, PlanOptions(seed=seed), home_rad)
        summary = session.run(tuple(rig.placements))
    zeros = identify_session(read(folder / "r.mcap")).zeros
    return SeedResult(seed, len(summary.samples), summary.skipped, compare_with_truth(zeros, folder / "truth.json"))


def line(result: SeedResult) -> str:
    """One seed: every identified zero as deviation from the truth in sigma, and its sigma."""
    cells = [
        f"J{one.joint} {one.deviation:+5.2f} ({1e6 * one.sigma_rad:.1f} urad)"
        if one.deviation is not None and one.sigma_rad is not None
        else f"J{one.joint}   -  "
        for one in result.revealed
    ]
    return f"seed {result.seed:3d}, {result.samples:3d} samples, {result.skipped} skipped:  " + "  ".join(cells)


def summary_line(results: list[SeedResult]) -> str:
    """How many zeros are within 3 sigma, and the worst."""
    deviations = np.abs([one.deviation for r in results for one in r.revealed if one.deviation is not None])
    within = int(np.sum(deviations <= 3.0))
    return (
        f"{within} of {len(deviations)} identified zeros within 3 sigma ({100.0 * within / len(deviations):.1f} %), "
        f"worst {deviations.max():.2f} sigma, rms {np.sqrt(np.mean(deviations**2)):.2f} sigma"
    )
