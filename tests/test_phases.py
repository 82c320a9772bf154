"""`make test` runs every test in one of its phases and reports each, whatever happened in those before."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests import fast, phases
from tests.conftest import on_wires
from tests.fast import distances

ROOT = Path(__file__).parents[1]
BODIES = {"fails": "def test_it(): assert False\n", "passes": "def test_it(): pass\n", "nothing": ""}


@pytest.fixture
def outcomes(tmp_path: Path) -> dict[str, phases.Outcome]:
    found = {}
    for name, body in BODIES.items():
        (tmp_path / f"test_{name}.py").write_text(body)
        alone = ("-c", os.devnull, "--rootdir", str(tmp_path), "-p", "no:cacheprovider", "-p", "no:xdist", "-q")
        phase = phases.Phase(name, (*alone, str(tmp_path / f"test_{name}.py")))
        found[name] = phases.run(phase, tmp_path / "results" / f"{name}.xml")
    return found


def test_a_failed_phase_counts_and_the_next_one_runs(outcomes):
    counts = {name: (o.exit_code, o.passed, o.failed) for name, o in outcomes.items()}
    # A phase in which nothing ran is a failure: pytest's exit code 5.
    assert counts == {"fails": (1, 0, 1), "passes": (0, 1, 0), "nothing": (5, 0, 1)}
    assert phases.table(list(outcomes.values()))[-1] == "total: 1 passed, 2 failed, 0 skipped"


@pytest.mark.parametrize("failing", [0, 1])
def test_every_phase_runs_and_one_failure_fails_the_whole(failing, monkeypatch, capsys):
    ran = []

    def outcome(phase, results):
        ran.append(phase.name)
        failed = int(len(ran) == failing)
        return phases.Outcome(phase.name, failed, 3, failed, 0, 1.0)

    monkeypatch.setattr(phases, "run", outcome)
    monkeypatch.setattr(sys, "argv", ["phases.py", "daily"])
    assert phases.main() == failing
    assert ran == [phase.name for phase in phases.DAILY]
    assert capsys.readouterr().out.splitlines()[-1] == f"total: 9 passed, {failing} failed, 0 skipped"


def test_no_test_falls_between_the_phases(request):
    conftest = next(p for p in request.config.pluginmanager.get_plugins() if hasattr(p, "WIRED"))
    everywhere, devices, sessions = (phase.arguments for phase in phases.DAILY)
    assert "not endure and not wired" in everywhere
    assert not [word for word in everywhere if word.startswith("tests")]
    assert "wired and not endure" in devices
    assert "wired and not endure" in sessions
    ignored = {word.removeprefix("--ignore=") for word in sessions if word.startswith("--ignore=")}
    for path in (Path("tests") / name for name in conftest.WIRED):
        with_others = any(path.is_relative_to(word) for word in devices if word.startswith("tests/"))
        alone = path.is_relative_to("tests/calibeam") and not any(path.is_relative_to(word) for word in ignored)
        assert with_others is not alone, path


@pytest.mark.parametrize(
    ("phase", "names"), [("devices", ["devices on wires"]), ("wires", ["devices on wires", "sessions on wires"])]
)
def test_a_phase_can_be_run_alone(phase, names, monkeypatch):
    ran = []
    monkeypatch.setattr(phases, "run", lambda p, results: ran.append(p.name) or phases.Outcome(p.name, 0, 1, 0, 0, 1.0))
    monkeypatch.setattr(sys, "argv", ["phases.py", "daily", "--phase", phase])
    assert phases.main() == 0
    assert ran == names


IMPORTERS = {
    "calibrate.model.rigid": {"calibrate.model.predict"},
    "calibrate.model.predict": {"calibeam.cli"},
    "calibeam.cli": set(),
}
OF_TESTS = {
    "tests/calibrate/model/test_rigid.py": {"calibrate.model.rigid"},
    "tests/calibrate/model/test_predict.py": {"calibrate.model.predict", "numpy"},
    "tests/calibeam/test_cli.py": {"calibeam.cli"},
    "tests/drivers/test_port.py": {"drivers.port"},
}


def test_near_is_counted_along_imports_and_what_does_not_reach_the_change_is_left_out():
    near = distances({"calibrate/model/rigid.py"}, IMPORTERS, OF_TESTS)
    assert near == dict(zip(OF_TESTS, (1, 2, 3), strict=False))
    assert distances({"tests/drivers/conftest.py"}, IMPORTERS, OF_TESTS) == {"tests/drivers/test_port.py": 0}
    assert distances({"docs/index.md"}, IMPORTERS, OF_TESTS) == {}


def test_what_a_change_touches_is_taken_from_the_nearest_on_and_the_laws_always(monkeypatch):
    monkeypatch.setattr(fast, "changed", lambda since: {"calibrate/model/predict.py"})
    monkeypatch.setattr(fast, "durations", lambda: {"tests/calibrate/model/test_predict.py": 3.0})
    files, left_out = fast.fast_files()
    assert files[: len(fast.LAWS)] == list(fast.LAWS)
    assert "tests/calibrate/model/test_predict.py" in files
    assert "farther off" in left_out
    assert not [path for path in files if on_wires(ROOT / path)]


@pytest.mark.parametrize("path", [".ci/run", "README.md"])
def test_it_is_what_ci_and_newcomers_run(path):
    assert re.search(r"make[ \w]* test\b", (ROOT / path).read_text())
    outside = {
        name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MAKELEVEL", "FAST", "PHASE")
    }
    for words, phases_of in (
        ("test", "daily"),
        ("test FAST=1", "fast"),
        ("test PHASE=devices", "daily --phase devices"),
    ):
        shown = subprocess.run(
            ["make", "-n", *words.split()], cwd=ROOT, env=outside, capture_output=True, text=True, check=True
        )
        assert f"tests/phases.py {phases_of}" in shown.stdout


def test_other_rounding_is_asked_for_by_environment():
    kernels = {phase.environment.get("OPENBLAS_CORETYPE") for phase in phases.endure()}
    threads = {phase.environment.get("OPENBLAS_NUM_THREADS") for phase in phases.endure()}
    assert {"2"} < threads
    assert kernels - {None} <= {"Haswell", "Zen", "SkylakeX"}


def test_other_pythons_are_tried_where_they_are(monkeypatch, tmp_path):
    own = "python{}.{}".format(*sys.version_info)
    for name, code in (("python3.12", 0), ("python3.13", 127), (own, 0)):  # a shim without its version ends with 127
        (tmp_path / name).write_text(f"#!/bin/sh\nexit {code}\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert phases.other_pythons() == [name for name in ("python3.12",) if name != own]
    assert {phase.interpreter for phase in phases.endure()} == {"", *phases.other_pythons()}
