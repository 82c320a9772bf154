"""What a command may take for an input of ordinary size: 300 readings, a shipped rig, the options' defaults.

The budgets are those of docs/commands.md: seconds of processor time and memory. They are several times what is needed,
so that they catch a loop without end or a table that grows with the wrong power, and no slow machine.
"""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted

ROOT = Path(__file__).parents[2]
RIG = ROOT / "rigs" / "ur5e-dual-psd.toml"
# The largest size of a process counts what its parent was when it started, and this one may be large: a small one
# stands between. Prints exit code, seconds of processor time, MB.
MEASURED = """
import os, subprocess, sys
with open("printed.txt", "w") as printed:
    process = subprocess.Popen(sys.argv[1:], stdin=subprocess.DEVNULL, stdout=printed, stderr=printed)
    _, status, used = os.wait4(process.pid, 0)
print(os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime, used.ru_maxrss * 1024 / 1e6)
"""
BUDGETS = {  # command line: seconds of processor time, MB
    "identify case/recording --out model.json": (30, 600),
    "report case/recording --out report.html": (60, 1000),
    "diagnose case/recording --out diagnosis.json": (90, 2000),
    "compare case/recording case/recording": (60, 1000),
    "predict model.json case/recording/samples.csv --out predicted.csv": (15, 600),
    "check case/recording": (15, 600),
    "import case/recording --out imported.mcap": (15, 600),
    "export imported.mcap --out exported": (15, 600),
    "recover imported.mcap --out recovered.mcap": (15, 600),
    f"design {RIG} --out plan.toml": (120, 1000),
    f"simulate-errors {RIG} --out errors": (120, 1000),
    "batch sessions --out fleet --jobs 1": (60, 1000),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("ordinary")
    for name, seed in (("case", 7), ("other", 8)):
        write_case(conceal(Wanted("dual-psd", seed, samples=300, places=3)), made / name)
    (made / "sessions").mkdir()
    for name in ("case", "other"):
        shutil.copytree(made / name / "recording", made / "sessions" / name)
    return made


@pytest.mark.endure
@pytest.mark.parametrize("words", BUDGETS)
def test_an_ordinary_input_stays_within_its_budget(words: str, folder: Path, record_property) -> None:
    command = [sys.executable, "-c", MEASURED, sys.executable, "-m", "calibeam", *words.split()]
    measured = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout.split()
    exit_code, took_s, held_mb = (float(word) for word in measured)
    assert exit_code in (0, 3), (folder / "printed.txt").read_text()[-2000:]
    record_property("processor_s", took_s)
    record_property("memory_mb", held_mb)
    print(f"{words}: {took_s:.1f} s, {held_mb:.0f} MB")
    limit_s, limit_mb = BUDGETS[words]
    assert took_s < limit_s
    assert held_mb < limit_mb


def test_the_budgets_are_those_of_the_documentation() -> None:
    page = (ROOT / "docs" / "commands.md").read_text()
    for words, (limit_s, limit_mb) in BUDGETS.items():
        assert f"| `{words.split()[0]}` | {limit_s} s | {limit_mb} MB |" in page
