"""Runs every phase of the tests, also after one that fails, and sums them up on the last line.

python tests/phases.py daily     what `make test` runs
python tests/phases.py fast      what the change of the last hour touches, and the laws: `make test FAST=1`
python tests/phases.py endure    what takes too long for every day, and the calculations as other processors round

With --phase WORD only the phases whose name has the word: `make test PHASE=calculating`.
"""

import argparse
import os
import shutil
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))  # this file is run as a script
TWO_AT_A_TIME = ("-n", "2", "--dist", "loadfile")  # a file's tests share their emulators, in their order
# Each worker takes one half in the order of the files, so that what a file shares is made once; whoever is through
# takes from the other's rest.
EVENLY = ("-n", "2", "--dist", "worksteal")
ANY_ORDER = ("-n", "2", "--dist", "load")  # tests of minutes, which share nothing
MUTATIONS = "tests/calibeam/mutations"
ON_WIRES = ("-m", "wired and not endure")
CALCULATING = ("-m", "not endure and not wired", *EVENLY)
ROUNDING = (*CALCULATING, "tests/calibrate", "tests/golden")  # where a last digit may decide
PYTHONS = ("python3.11", "python3.12", "python3.13")


# Of the program's tests on wires those without a motion: pages, workers, refusals, logs, checks. They leave others
# room, too.
PATIENT = tuple(
    f"tests/calibeam/{name}"
    for name in (
        "fleet", "live/test_browser.py", "live/test_page.py", "test_check_cli.py", "test_cli.py", "test_log_cli.py",
    )
)  # fmt: skip


@dataclass(frozen=True)
class Phase:
    """One run of pytest: its arguments, what its environment has beside that of the caller, and another Python."""

    name: str
    arguments: tuple[str, ...]
    environment: Mapping[str, str] = field(default_factory=dict[str, str])
    interpreter: str = ""  # a command; empty: the Python that runs this file


@dataclass(frozen=True)
class Outcome:
    """What a phase came to; `exit_code` is pytest's own."""

    name: str
    exit_code: int
    passed: int
    failed: int
    skipped: int
    duration_s: float


DAILY = (
    Phase("calculating", CALCULATING),
    Phase("devices on wires", (*ON_WIRES, *TWO_AT_A_TIME, "tests/drivers", "tests/simulators", *PATIENT)),
    Phase("sessions on wires", (*ON_WIRES, "tests/calibeam", *(f"--ignore={name}" for name in PATIENT))),
)


def fast() -> tuple[Phase, ...]:
    """One phase; what it leaves out is printed."""
    from tests.fast import fast_files

    files, left_out = fast_files()
    print(left_out)
    return (Phase("fast", (*CALCULATING, *files)),)


def endure() -> tuple[Phase, ...]:
    """The marked tests, then what rounds with other linear algebra and vector units, then other Pythons.

    OPENBLAS_CORETYPE chooses the kernels of OpenBLAS, NPY_DISABLE_CPU_FEATURES the loops of numpy, and NUMBA_CPU_NAME
    what numba compiles for: together they round as another processor does. Kernels that this processor cannot run are
    left out.
    """
    narrow = {"NPY_DISABLE_CPU_FEATURES": " ".join(_wide_vectors()), "NUMBA_CPU_NAME": "haswell"}
    kernels = [("Haswell", "avx2", narrow), ("Zen", "avx2", {}), ("SkylakeX", "avx512f", {})]
    able = _processor_flags()
    return (
        Phase("mutated files", (*enduring("endure"), *ANY_ORDER, MUTATIONS)),
        Phase("long calculations", (*enduring("endure and not wired"), *ANY_ORDER, f"--ignore={MUTATIONS}")),
        Phase("long on wires", enduring("endure and wired")),
        Phase("rounding, 2 threads", ROUNDING, {"OPENBLAS_NUM_THREADS": "2"}),
        *(
            Phase(f"rounding, {name}", ROUNDING, {"OPENBLAS_CORETYPE": name, **more})
            for name, flag, more in kernels
            if flag in able
        ),
        *(Phase(f"calculating, {name}", CALCULATING, interpreter=name) for name in other_pythons()),
    )


def enduring(marked: str) -> tuple[str, ...]:
    return ("-m", marked, "--timeout", "3600")


def other_pythons() -> list[str]:
    """Commands of PYTHONS that are here, but for the version that runs this file."""
    own = "python{}.{}".format(*sys.version_info)
    found = (name for name in PYTHONS if name != own and shutil.which(name))
    return [name for name in found if subprocess.run([name, "--version"], capture_output=True).returncode == 0]


def main() -> int:
    """0 when every phase passed, otherwise 1."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("which", choices=("daily", "fast", "endure"))
    parser.add_argument("--phase", default="", help="only phases whose name has this word")
    asked = parser.parse_args()
    every = {"daily": lambda: DAILY, "fast": fast, "endure": endure}[asked.which]()
    phases = [phase for phase in every if asked.phase in phase.name]
    if not phases:
        parser.error(f"--phase {asked.phase}: no phase of {asked.which} has this word in its name")
    outcomes = [run(phase, ROOT / "out" / "tests" / f"{phase.name.replace(' ', '-')}.xml") for phase in phases]
    print(*table(outcomes), sep="\n")
    return int(any(outcome.exit_code for outcome in outcomes))


def run(phase: Phase, results: Path) -> Outcome:
    """The phase in a pytest of its own; `results` receives its JUnit file."""
    results.parent.mkdir(parents=True, exist_ok=True)
    results.unlink(missing_ok=True)
    print(f"\n===== {phase.name} =====", flush=True)
    begin_s = time.monotonic()
    interpreter, code = _prepared(phase)
    command = [interpreter, "-m", "pytest", *phase.arguments, f"--junitxml={results}"]
    code = code or subprocess.run(command, cwd=ROOT, env=_environment(phase), check=False).returncode
    return Outcome(phase.name, code, *_counts(results, code), time.monotonic() - begin_s)


def _prepared(phase: Phase) -> tuple[str, int]:
    """The interpreter of this phase, and what its set-up ended with; another Python has its own environment."""
    if not phase.interpreter:
        return sys.executable, 0
    environment = ROOT / f".venv-{phase.interpreter}"
    words = ["make", "setup", f"VENV={environment.name}", f"PYTHON={phase.interpreter}"]
    return str(environment / "bin" / "python"), subprocess.run(words, cwd=ROOT, check=False).returncode


def _environment(phase: Phase) -> dict[str, str]:
    """The caller's and the phase's own. Bytecode is kept, or every process of every test compiles our sources again."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return {**kept, **phase.environment}


def table(outcomes: list[Outcome]) -> list[str]:
    """A line a phase, and the sum as the last line."""
    lines = [
        "",
        *(
            f"{o.name:>26}: {o.passed:5d} passed, {o.failed} failed, {o.skipped} skipped, {o.duration_s:.0f} s"
            + ("" if o.exit_code in (0, 1) else f", ended with pytest's exit code {o.exit_code}")
            for o in outcomes
        ),
    ]
    passed, failed, skipped = (sum(getattr(o, what) for o in outcomes) for what in ("passed", "failed", "skipped"))
    return [*lines, f"total: {passed} passed, {failed} failed, {skipped} skipped"]


def _counts(results: Path, exit_code: int) -> tuple[int, int, int]:
    """Passed, failed, skipped. A phase that left no file, or that failed without a failed test, is one failure."""
    if not results.exists():
        return 0, 1, 0
    suite = next(ET.parse(results).getroot().iter("testsuite"))
    tests, failed, errors, skipped = (int(suite.get(key, 0)) for key in ("tests", "failures", "errors", "skipped"))
    failed += errors
    return tests - failed - skipped, max(failed, int(exit_code != 0)), skipped


def _wide_vectors() -> list[str]:
    """What numpy has found here beyond AVX2, by its own names."""
    import numpy as np

    found = np.show_config(mode="dicts")["SIMD Extensions"]["found"]
    return [name for name in found if name == "X86_V4" or name.startswith("AVX512")]


def _processor_flags() -> set[str]:
    info = Path("/proc/cpuinfo")
    return set(info.read_text().split()) if info.exists() else set()


if __name__ == "__main__":
    sys.exit(main())
