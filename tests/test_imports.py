"""The import table: who may import whom, and what a fit must not need."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
# Not `socket` of the standard library: scipy loads it itself, for its tests' sake.
WIRE_LIBRARIES = ("serial", "can", "canopen", "rtde_control", "rtde_receive", "asyncio", "mujoco", "matplotlib")


def test_the_import_contracts_hold() -> None:
    """The contracts are in pyproject.toml, one for each row of the table in docs/architecture.md."""
    command = [str(Path(sys.executable).with_name("lint-imports")), "--no-cache"]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert result.returncode == 0, result.stdout


def test_a_command_loads_no_library_of_another() -> None:
    """Emulators start as a command of their own, in every demo and many tests."""
    script = (
        "import sys, calibeam.cli, calibeam.commands.emulate, simulators.serve\n"
        "print([name for name in ('scipy.stats', 'scipy.signal', 'matplotlib', 'numba') if name in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert result.stdout.strip() == "[]"


def test_calibrate_loads_no_library_of_a_wire() -> None:
    """A fit runs where no port, bus or socket library is installed."""
    script = (
        "import sys, calibrate.fit.identify.identify, calibrate.fit.identify.point_constraint, "
        "calibrate.model.dual_psd_rig, calibrate.model.observations, acquisition.recording.mcap.read\n"
        f"print([name for name in {WIRE_LIBRARIES!r} if name in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert result.stdout.strip() == "[]"


def test_one_file_of_at_most_400_lines_is_compiled() -> None:
    """numba compiles the forward kinematics and its derivative; everything else is numpy and scipy."""
    products = ("acquisition", "calibeam", "calibrate", "drivers", "simulators")
    sources = [path for folder in products for path in (ROOT / folder).rglob("*.py")]
    users = {
        str(path.relative_to(ROOT))
        for path in sources
        if re.search(r"^\s*(from|import) numba\b", path.read_text(), re.M)
    }
    assert users == {"calibrate/model/arms/fast.py"}
    assert len((ROOT / "calibrate/model/arms/fast.py").read_text().splitlines()) <= 400


def test_the_benchmarks_can_be_started() -> None:
    """They use inner parts of the program, and `make test` runs none of them."""
    __import__("benchmarks.__main__")
