"""Guard rails: the diagnosing process has the recording, and no way to the truth."""

import subprocess
import sys
from pathlib import Path

import pytest

from calibeam.prove.concealing import Concealed, conceal_cases, publish
from calibeam.prove.diagnosing import Blind, bare_environment
from calibeam.prove.scenario import Mix
from calibeam.prove.seal import Layout, fingerprint, open_seal

MIX = Mix(kinds=("one",), families=("tracker",), mechanism="encoder-eccentricity")


@pytest.fixture(scope="module")
def loaded() -> subprocess.CompletedProcess[str]:
    """A process with all that a diagnosis needs, which then asks for a simulator behind the bar."""
    script = (
        "import sys, calibeam.prove.blind, calibeam.results.diagnosis, calibeam.prove.unseen\n"
        "print([name for name in sys.modules if name.split('.')[0] == 'simulators'])\n"
        "sys.meta_path.insert(0, calibeam.prove.blind.NoSimulators())\n"
        "import simulators.conceal.case"
    )
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False)


def test_the_diagnosing_process_may_not_import_the_simulators(loaded: subprocess.CompletedProcess[str]) -> None:
    assert "may not import simulators" in loaded.stderr


def test_what_a_diagnosis_needs_loads_no_simulator(loaded: subprocess.CompletedProcess[str]) -> None:
    assert loaded.stdout.strip() == "[]"


def test_the_diagnosing_process_gets_a_bare_environment() -> None:
    passed = bare_environment({"PATH": "/bin", "CALIBEAM_SEAL": "sealed", "PWD": "/home/proof", "OLDPWD": "/home"})
    assert passed["PATH"] == "/bin"
    assert not {"CALIBEAM_SEAL", "PWD", "OLDPWD"} & set(passed)


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="needs /proc, to look into the process")
def test_a_diagnosing_process_that_runs_knows_no_seal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its variables, its command line, its folder and its open files, as the system tells them."""
    monkeypatch.setenv("CALIBEAM_SEAL", "held-by-the-parent")
    layout = Layout(tmp_path)
    layout.seal("case-0000").parent.mkdir()
    with layout.seal("case-0000").open("wb"):
        blind = Blind(layout.answers)
    try:
        process = Path(f"/proc/{blind.pid}")
        assert b"held-by-the-parent" not in (process / "environ").read_bytes() + (process / "cmdline").read_bytes()
        assert (process / "cwd").resolve() == layout.answers.resolve()
        assert not any("sealed" in str(fd.resolve()) for fd in (process / "fd").iterdir())
    finally:
        blind.close()


@pytest.fixture(scope="module")
def concealed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Layout, list[Concealed]]:
    layout = Layout(tmp_path_factory.mktemp("proof"))
    return layout, list(conceal_cases(layout, MIX, seed=11, cases=2, jobs=1, numbers=range(2)))


def test_nothing_of_the_truth_lies_in_clear_before_the_reveal(concealed: tuple[Layout, list[Concealed]]) -> None:
    layout, cases = concealed
    files = [p for p in layout.out.rglob("*") if p.is_file()]
    assert not any(b"eccentricity" in p.read_bytes() for p in files)
    for one in cases:
        name = one.scenario.name
        assert {p.name for p in layout.recording(name).iterdir()} == {"rig.toml", "samples.csv"}
        assert not any(str(one.scenario.wanted.seed).encode() in p.read_bytes() for p in files)
        truth = open_seal(layout.seal(name).read_bytes(), one.key, one.sha256)
        assert b"encoder-eccentricity" in truth


def test_the_published_hash_stands_for_all_seals(concealed: tuple[Layout, list[Concealed]]) -> None:
    layout, cases = concealed
    published = publish(layout, cases)
    assert published == fingerprint(layout.hashes.read_bytes())
    assert [line.split()[0] for line in layout.hashes.read_text().splitlines()] == [c.sha256 for c in cases]
