"""What a diagnosis costs: CPU time and memory of drawn sessions, its growth by rows, and the real recordings.

Every session is diagnosed in a fresh interpreter. A busy machine shows larger times, so each one also stands in fits
of geometry alone to the same session, taken by the same process.
"""

import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from calibeam.prove.concealing import write_recording
from simulators.conceal.case import conceal
from simulators.conceal.wanted import ConcealError, Wanted

REPEATS = 3  # of a fit of geometry alone: the median counts
GROWTH = (300, 1000, 3000)  # tracker rows
KILOBYTES_PER_MB = 1024.0  # of ru_maxrss
DRAWS = 40
ROW = "{:34s} {:>6s} {:>9s} {:>14s} {:>8s} {:>9s}"


@dataclass(frozen=True)
class Cost:
    """Of one diagnosis."""

    samples: int
    cpu_s: float
    geometry_s: float  # one fit of geometry alone
    before_mb: float  # peak of the process when the recording was read
    peak_mb: float
    findings: int

    def text(self, what: str) -> str:
        """A line of the table."""
        ratio = f"{self.cpu_s / self.geometry_s:.0f}"
        memory = f"{self.peak_mb:.0f}"
        return ROW.format(what, str(self.samples), f"{self.cpu_s:.1f}", ratio, memory, str(self.findings))


def lines(data: Path) -> Iterator[str]:
    """The table, line by line as it is measured; real recordings of `data` where there are any."""
    yield ROW.format("session", "rows", "CPU s", "geometry fits", "peak MB", "findings")
    with tempfile.TemporaryDirectory() as folder:
        for what, wanted in drawn():
            yield _drawn_cost(Path(folder) / what.replace(" ", "-"), wanted).text(what)
        found: list[Cost] = []
        for rows in GROWTH:
            wanted = Wanted(family="tracker", seed=5006, defects=("any",), enr=1.5, samples=rows, places=3)
            found.append(_drawn_cost(Path(folder) / f"rows-{rows}", wanted))
            yield found[-1].text("tracker, one effect, by rows")
        yield f"growth by rows: exponent {exponent(found):.2f}"
    for session in sorted(path.parent for path in data.glob("*/rig.toml")) if data.is_dir() else []:
        yield cost_of(session).text(session.name)


def drawn() -> Sequence[tuple[str, Wanted]]:
    """Sessions as a proof draws them."""
    one = Wanted(family="dual-psd", seed=5001, defects=("any",), enr=1.5, samples=300, places=3)
    return (
        ("two detectors, one effect", one),
        ("two detectors, nothing", replace(one, seed=5003, defects=())),
        ("tracker, one effect", replace(one, family="tracker", seed=5002)),
        ("tracker, three effects", replace(one, family="tracker", seed=5004, defects=("any",) * 3)),
        ("two detectors, eighteen effects", replace(one, seed=5005, defects=("any",) * 18, samples=400, places=6)),
    )


def exponent(costs: Sequence[Cost]) -> float:
    """Slope of log time over log rows."""
    rows, times = np.log([c.samples for c in costs]), np.log([c.cpu_s for c in costs])
    return float(np.polyfit(rows, times, 1)[0])


def cost_of(session: Path) -> Cost:
    """In a fresh interpreter."""
    command = [sys.executable, "-m", "benchmarks.diagnosis_speed", str(session)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return Cost(**json.loads(done.stdout))


def _drawn_cost(folder: Path, wanted: Wanted) -> Cost:
    """Of the first seed from the wanted one on that gives a session."""
    for seed in range(wanted.seed, wanted.seed + DRAWS):
        try:
            case = conceal(replace(wanted, seed=seed))
        except ConcealError:
            continue
        write_recording(case, folder)
        return cost_of(folder)
    raise ConcealError(f"no session from seeds {wanted.seed} to {wanted.seed + DRAWS - 1}")


def measured(session: Path) -> Cost:
    """In this interpreter."""
    from acquisition.recording import read
    from calibeam.results.diagnosis import diagnose_recording
    from calibrate.diagnose.state.fitted import fit_geometry
    from calibrate.diagnose.state.session import session_of

    recording = read(session)
    before_mb = _peak_mb()
    geometry_s = []
    for _ in range(REPEATS):
        begun = time.process_time()
        fit_geometry(session_of(recording.rig, recording.samples))
        geometry_s.append(time.process_time() - begun)
    begun = time.process_time()
    _, file = diagnose_recording(recording)
    cpu_s = time.process_time() - begun
    fit_s = float(np.median(geometry_s))
    return Cost(len(recording.samples), cpu_s, fit_s, before_mb, _peak_mb(), len(file.findings))


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / KILOBYTES_PER_MB


if __name__ == "__main__":
    print(json.dumps(vars(measured(Path(sys.argv[1])))))
