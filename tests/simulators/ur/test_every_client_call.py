"""Every public method of ur_rtde and urx, called once: it works, with a value of the world, or is refused at once.

One emulator for all. The tables (ur_rtde_calls.py, urx_calls.py) are sessions: rows are called in order, by a process
that reports a call which does not return (call_clients.py). A law holds each table against the classes of the installed
client, so that a new version with other methods is noticed. What is refused says so in the words of the client or of
the controller.
"""

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tests.simulators.ur.ur_rtde_calls import UR_RTDE
from tests.simulators.ur.urx_calls import URX

CALLER = Path(__file__).with_name("call_clients.py")
CLIENTS = Path(__file__).parents[3] / ".venv-clients/bin/python"
# Names that are no calls, or none that reaches the controller.
NOT_CALLED = {
    "control": {"FLAGS_DEFAULT", "Feature", "Flags", "FEATURE_BASE", "FEATURE_CUSTOM", "FEATURE_TOOL"}
    | {f"FLAG_{name}" for name in ("CUSTOM_SCRIPT", "DISABLE_REMOTE_CONTROL_CHECK", "NO_EXT_FT", "NO_WAIT")}
    | {f"FLAG_{name}" for name in ("UPLOAD_SCRIPT", "UPPER_RANGE_REGISTERS", "USE_EXT_UR_CAP", "VERBOSE")},
    "script": {"setScriptFile"},  # bound without its argument: ur_rtde 1.6.5 crashes
    "secondary": {"run"},  # the loops of their threads
    "realtime": {"run", "rtstruct540", "rtstruct692"},
}
TABLES = {"ur_rtde": (UR_RTDE, Path(sys.executable)), "urx": (URX, CLIENTS)}


@dataclass(frozen=True)
class Session:
    """What the client's process reported."""

    results: list[dict[str, Any]]
    members: dict[str, list[str]]


@pytest.fixture(scope="module", params=TABLES)
def family(request: pytest.FixtureRequest) -> str:
    if not TABLES[request.param][1].exists():
        pytest.skip("no environment for third-party clients: make clients")
    return request.param


@pytest.fixture(scope="module")
def session(family: str, fresh_emulated, tmp_path_factory: pytest.TempPathFactory) -> Session:
    """The whole table of a client, called once."""
    table, python = TABLES[family]
    folder = tmp_path_factory.mktemp(family)
    (folder / "custom.script").write_text(
        "def lit():\n  write_output_integer_register(0, 1)\n  set_standard_digital_out(4, True)\n"
        "  write_output_integer_register(0, 2)\nend\n"
    )
    steps = json.dumps([row.step for row in table]).replace("@custom", str(folder / "custom"))
    command = [str(python), "-W", "ignore", str(CALLER), family, fresh_emulated.host, str(fresh_emulated.control[1])]
    done = subprocess.run(command, input=steps, capture_output=True, text=True, timeout=300.0, check=False)
    members, *results = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    assert done.returncode == 0, f"crashed in {table[len(results)]}: {done.stderr[-2000:]}"
    return Session(results, members)


def test_every_call_works_or_is_refused_at_once(family: str, session: Session) -> None:
    table = TABLES[family][0]
    wrong = [
        f"{row.on}.{row.call}{row.args}: {result}"
        for row, result in zip(table, session.results, strict=False)
        if not row.agrees(result)
    ]
    assert not wrong, "\n".join(wrong)
    assert len(session.results) == len(table)  # a call that hangs ends the session


def test_the_table_holds_every_public_method(family: str, session: Session) -> None:
    called: dict[str, set[str]] = {}
    for row in TABLES[family][0]:
        called.setdefault(row.on, set()).add(row.call)
    missing = {
        name: set(members) - called[name] - NOT_CALLED.get(name, set()) for name, members in session.members.items()
    }
    assert missing == {name: set() for name in session.members}
