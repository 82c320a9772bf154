"""A million perturbed arms at one pose: time on one core, memory, and the same answer whoever draws them."""

import resource
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from acquisition.recording.rig import load_rig
from calibrate.error_simulation.error_plan import (
    NOTHING_STATED,
    ErrorPlan,
    SourceEntry,
    read_error_plan,
    sources_of,
)
from calibrate.error_simulation.machine import machine_of
from calibrate.error_simulation.monte_carlo import Drawn, draw_arms
from calibrate.error_simulation.sensitivity import propagate

MILLION = 1_000_000
GEOMETRY = ErrorPlan(
    1,
    (
        SourceEntry(("link*.x", "link*.y", "link*.z"), scale_m=5e-5),
        SourceEntry(("link*.roll", "link*.pitch", "link*.yaw", "joint*.zero"), scale_rad=1e-4),
    ),
    believed=False,
)


def lines(rigs: Path) -> Iterator[str]:
    arm, robot = load_rig(rigs / "arm-cmm-reference.toml"), load_rig(rigs / "ur5e-dual-psd.toml")
    everything = read_error_plan(rigs / "errors" / "arm-cmm.toml")
    cases = (
        ("reference arm, six errors a link and zeros", arm, GEOMETRY),
        ("reference arm, every kind of error", arm, everything),
        ("UR5e, what its rig file believes", robot, NOTHING_STATED),
    )
    for says, rig, plan in cases:
        machine = machine_of(rig)
        sources = sources_of(machine, rig, plan)
        q_rad = machine.drawn_poses(1, np.random.default_rng(1))
        linear = propagate(machine, sources, q_rad)

        def drawn(arms: int, workers: int = 1, now=(machine, sources, q_rad, linear)) -> Drawn:
            return draw_arms(*now[:3], arms, seed=1, rms_m=now[3].rms_m, workers=workers)

        drawn(1000)
        seconds = []
        for _ in range(5):
            begin = time.process_time()
            found = drawn(MILLION)
            seconds.append(time.process_time() - begin)
        same = np.array_equal(found.covariance_m2, drawn(MILLION, workers=2).covariance_m2)
        yield (
            f"{says} ({len(sources)} errors): 1,000,000 arms in {np.median(seconds):.3f} s of one core; rms "
            f"{1e6 * found.rms_m[0]:.2f} um drawn, {1e6 * linear.rms_m[0]:.2f} um linear; two workers the same: {same}"
        )
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        drawn(5 * MILLION)
        more = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
        yield f"  5,000,000 arms take {more} KiB more than 1,000,000"
