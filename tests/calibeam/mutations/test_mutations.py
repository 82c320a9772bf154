"""Every file format mutated against every command that reads it: no traceback, no hang, 1 GB, one short message.

A command answers bad content with exit code 1 and a line `error: …`, or keeps what is good of it and ends with 3 and
`stopped: …`; a mutation that leaves the file good ends with 0. Code 2 is for words of the command line alone. A failure
names the command that repeats it: see cases.py.
"""

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from calibeam.command_list import COMMANDS
from tests.calibeam.mutations.cases import Fault, faults, lay_out, run_case, run_in_turn
from tests.calibeam.mutations.recording_mutators import rewritten
from tests.calibeam.mutations.server import Ran, Server, watched
from tests.calibeam.mutations.table import DAILY as DAILY_SEEDS
from tests.calibeam.mutations.table import ENDURE, EXEMPT, TABLE, Pair, missing
from tests.calibeam.mutations.table_mutators import with_member

Change = Callable[[bytes], bytes]

CHUNK = 100  # seeds of one test
IN_TURN = 10  # runs of one process, every day; a hundred of each have a process of their own
REAL = (  # through the installed console script as well: one of each way to end
    ("fit.toml|identify_tracker_--plan_fit.toml", 3),
    ("model.json|predict_model.json_tracker:samples.csv", 1),
    ("streams.mcap|recover_streams.mcap_--out_made.mcap", 2),
    ("bus.asc|import_bus.asc_--rig_rig.toml_--out_made.mcap", 4),
    ("tracker:samples.csv|export_tracker_--out_made", 0),
    ("rig.toml|check_rig.toml", 5),
)
PSD_CHECK = "psd-check rig.toml --points points.csv --no-wait"
CONTINUE = "session rig.toml --continue --out begun --yes"
MJCF, DH = "rig new --from-mjcf arm.xml --tip-link tip --out made.toml", "rig new --from-dh dh.csv --out made.toml"
POSES = "correct arm.json poses.csv --out made.csv"
KRL, RAPID = (f"correct arm.json weld.{one} --out made.{one}" for one in ("src", "mod"))
LAB, BAG = (
    "import lab.xlsx --rig tracker/rig.toml --yes --out made",
    "import bag-db3 --rig tracker/rig.toml --yes --out a.mcap",
)
SHEET = "xl/worksheets/sheet1.xml"
FACTOR = b"(0.00034332275390625,0)"
FOUND = (  # what mutations have shown once: file, change, command line, what is in its answer
    ("encoders.dbc", lambda data: data.replace(FACTOR, b"(0,0)", 1), "check rig.toml", "correct the DBC file"),
    ("encoders.dbc", lambda data: data + b"BO_ " * 2000, "check rig.toml", "export it again"),
    ("psd1.json", lambda data: data[:-9], "check rig.toml", "no error map of format"),
    ("psd1.json", lambda data: b"[" * 100_000, "session rig.toml --out made --yes", "no error map of format"),
    ("points.csv", lambda data: data.replace(b"-0.006", b"1e308", 1), PSD_CHECK, "row 1: x_m = 1e+308"),
    ("points.csv", lambda data: b"\xff" + data, PSD_CHECK, "it needs columns x_m, y_m"),
    ("begun/recording.mcap", lambda data: _other_events(data), CONTINUE, "do not contain which poses are done"),
    ("arm.xml", lambda data: data.replace(b"0.4 0 0", b"1e308 0 0"), MJCF, "1e+308 m stands in it"),
    ("arm.xml", lambda data: data.replace(b"0.7 0.7", b"1e308 1e308"), MJCF, "has no direction"),
    ("dh.csv", lambda data: data.replace(b"400", b"400000"), DH, "row 2: Expected `float` <= 20.0 - at `$.a_m`"),
    ("weld.src", lambda data: data.replace(b"400.0", b"1e308"), KRL, "has a number beyond 1 km or 100000 rad"),
    ("weld.mod", lambda data: data.replace(b"MoveL", b"MoveL " * 9000), RAPID, "a line of more than 10000 letters"),
    ("lab.xlsx", lambda data: with_member(data, SHEET, lambda text: text[:-9]), LAB, "save it again"),
    ("weld.src", lambda data: data.replace(b"{X 0.0", b"{X 1" + 306 * b"0", 1), KRL, "a frame or tool has a number"),
    ("poses.csv", lambda data: data.replace(b"\n0.", b"\n1e308", 1), POSES, "row 1 (line 2), x_m: "),
    (
        "model.json",
        lambda data: _negative_variance(data),
        "report tracker --model model.json",
        "no covariance is",
    ),
    ("bag-db3/metadata.yaml", lambda data: b"\xff" + data, BAG, "no bag of ROS that can be read"),
)
AWAY = re.compile(  # of a session without its devices, and of a program whose second pose is out of reach
    r"serial port away/|could not open port|127\.0\.0\.9|not fit for a session|cannot be opened|have no command"
    r"|left, named|what it lacks is listed above"
)


def _negative_variance(data: bytes) -> bytes:
    model = json.loads(data)
    model["covariance"]["rows"][0][0] *= -1.0
    return json.dumps(model).encode()


def _other_events(data: bytes) -> bytes:
    """Poses under another name, in every message, with the checksums of the new ones."""
    return rewritten(data, lambda message: message.replace(b'"first":1', b'"fiest":1'))


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("m") / "good"


@pytest.fixture(scope="module")
def server(good: Path) -> Iterator[Server]:
    with Server(good) as running:
        yield running


def named(pair: Pair, seeds: range) -> str:
    return f"{pair.name}|{seeds.start}-{seeds.stop - 1}"


def ran_into(
    server: Server, good: Path, pair: Pair, seeds: range, scratch: Path, *, in_turn: bool = False
) -> list[Fault]:
    found: list[Fault] = []
    if in_turn and not pair.together:
        for first in range(seeds.start, seeds.stop, IN_TURN):
            some = range(first, min(first + IN_TURN, seeds.stop))
            found += run_in_turn(server, good, pair, some, scratch / f"turn-{first}")
        return found
    for seed in range(seeds.start, seeds.stop, max(1, pair.together)):
        some = range(seed, min(seed + max(1, pair.together), seeds.stop))
        found += run_case(server, good, pair, some, scratch / "case")[1]
        shutil.rmtree(scratch / "case")  # thousands of them fill a disk
    return found


DAILY = [(pair, range(pair.daily)) for pair in TABLE if pair.daily]
ENDURED = [(pair, range(first, min(first + CHUNK, ENDURE))) for pair in TABLE for first in range(0, ENDURE, CHUNK)]


@pytest.mark.parametrize(("pair", "seeds"), DAILY, ids=[named(*one) for one in DAILY])
def test_a_mutated_file_is_refused_in_one_message_or_read(
    pair: Pair, seeds: range, server: Server, good: Path, tmp_path: Path
) -> None:
    found = ran_into(server, good, pair, seeds, tmp_path, in_turn=True)
    assert not found, "\n".join(map(str, found))


@pytest.mark.endure
@pytest.mark.parametrize(("pair", "seeds"), ENDURED, ids=[named(*one) for one in ENDURED])
def test_so_are_a_hundred_of_each(pair: Pair, seeds: range, server: Server, good: Path, tmp_path: Path) -> None:
    found = ran_into(server, good, pair, seeds, tmp_path)
    assert not found, "\n".join(map(str, found))


def test_every_command_stands_in_the_table_or_has_a_reason_not_to() -> None:
    assert not missing()
    assert EXEMPT.keys() <= COMMANDS.keys()
    assert len({pair.name for pair in TABLE}) == len(TABLE)


def test_every_file_that_is_mutated_is_there_and_the_same_seed_gives_the_same_bytes(server: Server, good: Path) -> None:
    for pair in TABLE:
        assert (good / pair.file).is_file(), pair.file
    some = TABLE[0]
    assert some.mutated(good, 7) == some.mutated(good, 7)
    assert len({some.mutated(good, seed) for seed in range(20)}) > 15


@pytest.mark.parametrize("pair", [pair for pair in TABLE if pair.daily == DAILY_SEEDS], ids=lambda pair: pair.name)
def test_the_good_file_is_taken(pair: Pair, server: Server, good: Path, tmp_path: Path) -> None:
    """Else its mutations would all end at the same refusal, and try nothing."""
    shutil.copytree(good, tmp_path / "case")
    ran = server.run(pair.words.split(), tmp_path / "case", 60.0, 10**9)
    assert ran.code == 0 or AWAY.search(ran.out + ran.err), ran.err


@pytest.mark.parametrize(
    ("name", "seed"), [pytest.param(*one, marks=() if k < 3 else pytest.mark.endure) for k, one in enumerate(REAL)]
)
def test_a_fork_ends_as_the_console_script_does(
    name: str, seed: int, server: Server, good: Path, tmp_path: Path
) -> None:
    pair = next(pair for pair in TABLE if pair.name == name)
    forked, _ = run_case(server, good, pair, range(seed, seed + 1), tmp_path / "forked")
    lay_out(good, pair, range(seed, seed + 1), tmp_path / "real")
    script = Path(sys.executable).with_name("calibeam")
    done = subprocess.run(
        [str(script), *pair.words.split()],
        cwd=tmp_path / "real",
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stderr) == (forked.code, forked.err)
    assert done.stdout.splitlines()[:1] == forked.out.splitlines()[:1]


@pytest.mark.parametrize(("file", "change", "words", "lines"), FOUND, ids=[f"{one[0]}-{one[3]}" for one in FOUND])
def test_what_was_found_is_answered(
    file: str, change: Change, words: str, lines: str, server: Server, good: Path, tmp_path: Path
) -> None:
    shutil.copytree(good, tmp_path / "case")
    (tmp_path / "case" / file).write_bytes(change((good / file).read_bytes()))
    ran = server.run(words.split(), tmp_path / "case", 60.0, 10**9)
    assert lines in ran.out + ran.err
    assert not faults(Pair(file, words), 0, ran)


@pytest.mark.parametrize(
    ("ran", "lines"),
    [
        (Ran(0, "fine", "", 0.1, 0.1, 1000), None),
        (Ran(1, "", "error: tracker: no samples\n", 0.1, 0.1, 1000), None),
        (
            Ran(1, "", "Traceback (most recent call last):\n  x\nValueError: y\n", 0.1, 0.1, 1000),
            "traceback: ValueError",
        ),
        (Ran(1, "", "no reason\n", 0.1, 0.1, 1000), "without a line"),
        (Ran(0, "", "error: but good\n", 0.1, 0.1, 1000), "exit code 0"),
        (Ran(2, "", "usage", 0.1, 0.1, 1000), "exit code 2"),
        (Ran(-11, "", "", 0.1, 0.1, 1000), "exit code -11"),
        (Ran(1, "", f"error: {'x' * 301}\n", 0.1, 0.1, 1000), "301 characters"),
        (Ran(0, "", "", 0.1, 0.1, 2_000_000_000), "took 2000 MB"),
        (Ran(-9, "", "", 70.0, 60.1, 1000, "took too long"), "took too long: 60.1 s of a core"),
    ],
)
def test_what_counts_as_a_fault(ran: Ran, lines: str | None) -> None:
    found = faults(next(pair for pair in TABLE if pair.kind == "binary"), 0, ran)
    assert (lines is None and not found) or (lines is not None and lines in found[0])


def test_a_run_that_hangs_or_fills_the_memory_is_ended() -> None:
    for limit_s, limit_bytes, why in ((0.0, 10**9, "took too long"), (60.0, 0, "took ")):
        with subprocess.Popen(["sleep", "1000"]) as waits:
            assert watched(waits.pid, limit_s, limit_bytes).startswith(why)


def test_a_fork_reaches_no_other_machine(server: Server, good: Path, tmp_path: Path) -> None:
    text = (good / "rig.toml").read_text("utf-8")
    (tmp_path / "rig.toml").write_text(text.replace("127.0.0.9", "robot.example").replace("psd1.json", ""), "utf-8")
    ran = server.run(["move", "rig.toml", "--home", "--dry-run"], tmp_path, 60.0, 10**9)
    assert "no network in this test" in ran.err


def test_runs_in_turn_end_as_each_by_itself(server: Server, good: Path, tmp_path: Path) -> None:
    """A folder that is not there ends the process: those after it are missing, and are run by themselves."""
    words, folders = ["check", "tracker"], [tmp_path / name for name in ("good", "bad", "also")]
    for folder in folders:
        shutil.copytree(good / "tracker", folder / "tracker")
    (folders[1] / "tracker" / "samples.csv").write_bytes(b"\0")
    together = server.run_in_turn(words, folders, 60.0, 10**9)
    alone = [server.run(words, folder, 60.0, 10**9) for folder in folders]
    assert [(ran.code, ran.out, ran.err) for ran in together] == [(ran.code, ran.out, ran.err) for ran in alone]
    assert [ran.code for ran in together] == [0, 1, 0]
    ended = server.run_in_turn(words, [folders[0], tmp_path / "nowhere", folders[2]], 60.0, 10**9)
    assert [ran.code for ran in ended] == [0]
