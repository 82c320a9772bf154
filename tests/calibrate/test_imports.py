"""Fits run where no instrument can be reached: calibrate loads no library for ports, buses or drivers."""

import subprocess
import sys

FORBIDDEN = ("serial", "can", "canopen", "rtde_control", "rtde_receive", "drivers", "simulators", "mujoco", "calibeam")
PROGRAM = """
import pkgutil, sys, importlib, calibrate
skip = "calibrate.report"
for module in pkgutil.walk_packages(calibrate.__path__, "calibrate."):
    if not module.name.startswith(skip):
        importlib.import_module(module.name)
print(" ".join(sorted({name.split(".")[0] for name in sys.modules})))
"""


def test_calibrate_loads_no_port_library():
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True, timeout=60)
    assert not set(FORBIDDEN) & set(done.stdout.split())
