"""pylablib's client for the KPA101, unmodified and in a process and environment of its own, against the emulator."""

import json
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
CLIENTS = ROOT / ".venv-clients/bin/python"
SCRIPT = Path(__file__).with_name("ask_with_pylablib.py")


@pytest.fixture
def answers(served) -> dict:
    if not CLIENTS.exists():
        pytest.skip("no environment for third-party clients: make clients")
    command = [str(CLIENTS), "-E", str(SCRIPT), served.host, str(served.port)]
    found = subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)
    assert found.returncode == 0, found.stderr
    return json.loads(found.stdout.splitlines()[-1])


def test_pylablib_reads_and_sets_everything(answers):
    assert answers["info"] == {"serial_no": 69250001, "model_no": "KPA101", "fw_ver": "1.0.7"}
    assert answers["readings"] == pytest.approx(
        {
            "xdiff": 3.0,  # it turns x round, and so did the unit
            "ydiff": -1.0,
            "sum": 4.0 / 10.0 * 65535 / 32767 * 20.0,  # it takes 20 V for 32767 counts, the unit 10 V for 65535
            "xpos": 3.0,
            "ypos": -1.0,
        },
        abs=0.001,
    )
    assert (answers["mode"], answers["open"], answers["monitor"]) == ("monitor", "open_loop", "monitor")
    assert answers["output"] == pytest.approx({"xpos": -1.5, "ypos": -2.5}, abs=0.001)  # its own set and get disagree
    assert answers["pid"]["p"] == pytest.approx(0.25, abs=1e-4)
    assert answers["parameters"]["route"] == "sma_only"
    assert answers["rate_hz"] < 400.0  # a reply takes 1.6 ms on the line, and pylablib waits 3 ms after every write
