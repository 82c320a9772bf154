"""Another project's pytest asks for emulated devices by the name of a robot."""

import os
import subprocess
import sys

import pytest

TEST = """
import socket

def test_a_controller_answers(start_emulators):
    robot = start_emulators("ur5e", time_scale=4.0).address["robot"]
    with socket.create_connection((robot["host"], 30004), timeout=5.0):
        pass
"""
DOES_NOT_LOAD = """
import sys

def test_nothing_is_loaded_before_it_is_asked_for():
    assert not [name for name in sys.modules if name.startswith(("calibrate", "simulators", "numpy"))]
"""


def run_of(folder, text):
    (folder / "test_other.py").write_text(text)
    again = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
    again["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    words = [sys.executable, "-m", "pytest", "-q", "-p", "calibeam.pytest_plugin", "-p", "no:cacheprovider"]
    again["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"  # whether it is installed here or not
    return subprocess.run([*words, "test_other.py"], cwd=folder, env=again, capture_output=True, text=True, timeout=90)


@pytest.mark.wired
def test_the_emulation_is_there_and_ends_with_the_test(tmp_path):
    ran = run_of(tmp_path, TEST)
    assert ran.returncode == 0, ran.stdout + ran.stderr


def test_pytest_starts_without_the_product(tmp_path):
    ran = run_of(tmp_path, DOES_NOT_LOAD)
    assert ran.returncode == 0, ran.stdout + ran.stderr
