"""Fits run where no instrument can be reached, and start at once: what calibrate loads when all of it is imported."""

import subprocess
import sys

import pytest

FORBIDDEN = ("serial", "can", "canopen", "rtde_control", "rtde_receive", "drivers", "simulators", "mujoco", "calibeam")
# Each costs 0.1 to 0.4 s of every start, and none is needed before there is something to draw or a batch to run.
SLOW = ("scipy.stats", "scipy.optimize", "scipy.interpolate", "scipy.ndimage", "numba", "llvmlite", "matplotlib")
# stages before and after the fit, loaded by their command
LATER = (
    "calibrate.report",
    "calibrate.apply.correct",
    "calibrate.apply.programs",
    "calibrate.diagnose",
    "calibrate.model.effects",
    "calibrate.apply.export.not_carried",  # of a model with effects
    "calibrate.model.with_effects",
    "calibrate.apply.predicting",
    "calibrate.compare",
    "calibrate.error_simulation",
    "calibrate.iso9283",
    "calibrate.design",
    "calibrate.excitation",
    "calibrate.tool_axes",
    "calibrate.verify",
)
MOST_MODULES = 850  # 692 with CPython 3.11, of which 144 are numpy and 175 scipy; scipy.stats alone would add 300
PROGRAM = """
import sys, importlib, calibrate
from pathlib import Path
COMPILED = ("calibrate.model.arms.fast",)
root = Path(calibrate.__path__[0])
files = sorted(path.relative_to(root.parent).with_suffix("") for path in root.rglob("*.py"))
names = [".".join(file.parts).removesuffix(".__init__") for file in files if file.stem != "__main__"]
for later in (tuple(sys.argv[1:]), ("calibrate.report",)):
    for name in names:
        if not name.startswith((*later, *COMPILED)):
            importlib.import_module(name)
    print(" ".join(sorted(sys.modules)))
"""


@pytest.fixture(scope="module")
def loaded():
    """Modules with all of calibrate but `LATER`, then with all but the report."""
    command = [sys.executable, "-c", PROGRAM, *LATER]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    return [set(line.split()) for line in done.stdout.splitlines()]


def test_calibrate_loads_no_port_library(loaded):
    assert not set(FORBIDDEN) & {name.split(".")[0] for name in loaded[1]}


def test_no_slow_library_is_loaded_before_it_is_needed(loaded):
    loaded, _ = loaded
    assert "calibrate.fit.identify.identify" in loaded
    assert not set(SLOW) & loaded
    assert len(loaded) <= MOST_MODULES
