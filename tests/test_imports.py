"""The import table: who may import whom, and what a fit must not need."""

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
        "import sys, calibrate.identification.identify, calibrate.identification.point_constraint, "
        "calibrate.dual_psd_rig, calibrate.read_samples, acquisition.recording.read\n"
        f"print([name for name in {WIRE_LIBRARIES!r} if name in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert result.stdout.strip() == "[]"
