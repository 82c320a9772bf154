"""What a diagnosis of torques costs: CPU time and memory of 10 s at 500 Hz of six joints, three mechanisms in them.

In a fresh interpreter, from reading nothing to the last finding; the whole catalogue takes part.
"""

import resource
import subprocess
import sys
import time
from collections.abc import Iterator

import numpy as np

from acquisition.recording.examination import ExaminationRecord
from benchmarks.drawn_motion import Hidden, recorded
from calibrate.diagnose.motion.torques import diagnose_torques

KILOBYTES_PER_MB = 1024.0  # of ru_maxrss
MECHANISMS = Hidden(coulomb={3: 4.0}, viscous={1: 6.0}, spring={4: 3.0})
MOST_S, MOST_MB = 20.0, 600.0


def lines() -> Iterator[str]:
    """One line, and the limits that were asked for."""
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.motion_cost"], stdout=subprocess.PIPE, text=True, check=True
    )
    yield done.stdout.strip()
    yield f"asked for: {MOST_S:g} s of CPU, {MOST_MB:g} MB"


def measured() -> str:
    """In this process."""
    recording = recorded(MECHANISMS, length_s=10.0)
    begun = time.process_time()
    found = diagnose_torques(recording, np.random.default_rng(1))
    spent_s = time.process_time() - begun
    if isinstance(found, ExaminationRecord):
        raise ValueError(found.reason)
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / KILOBYTES_PER_MB
    tried, causes = len(found.bare.candidates()), len(found.diagnosis.findings)
    return f"10 s at 500 Hz, 6 joints, {tried} candidates: {spent_s:.1f} s of CPU, {peak_mb:.0f} MB, {causes} causes"


if __name__ == "__main__":
    print(measured())
