"""An answer counts only if it was typed after the question was on the screen; who cannot be asked has not agreed."""

import ast
import os
import sys
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from acquisition.errors import AcquisitionError
from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan, write_pose_plan
from calibeam import asking
from calibeam.asking import Asking, NotAgreedError
from calibeam.cli import run
from calibeam.commands import centre, psd_check
from calibeam.motion import by_hand, task_by_hand
from calibeam.sessions import run as on_site
from calibeam.sessions import with_tracker
from calibeam.sessions.with_detectors import WithDetectors

ROOT = Path(__file__).parents[2]
RIG, CAMERA_RIG, TRACKER_RIG = (
    ROOT / "rigs" / f"ur5e-{name}.toml" for name in ("dual-psd", "dual-psd-camera", "tracker")
)
CUE, PLACE_CUE = "Type go to move, no to leave it: ", "ENTER to go on, q to end: "
PRODUCT = ("acquisition", "calibeam", "calibrate", "drivers", "simulators")
# Every module that asks, or hands on who is asked.
ASKS = {
    "calibeam/guided/touched.py",
    "calibeam/commands/camera.py",
    "calibeam/commands/centre.py",
    "calibeam/commands/import_files.py",
    "calibeam/commands/psd_check.py",
    "calibeam/commands/session.py",
    "calibeam/motion/by_hand.py",
    "calibeam/motion/task_by_hand.py",
    "calibeam/sessions/keys.py",
    "calibeam/sessions/person.py",
    "calibeam/sessions/with_detectors.py",
    "calibeam/sessions/with_tracker.py",
}
TASK = """[transform]
P = { origin_m = [-0.45, -0.25, 0.25], rotation_rad = [3.1, 0.1, 0.05] }
[position]
"at pin" = "T6 = P"
[[step]]
do = "move"
to = "at pin"
"""
PROMPTERS = {"input", "rich.prompt", "readline", "getpass", "click"}
# Processes whose standard input is a pipe of the program that started them.
FED = {"calibeam/fleet/worker.py", "calibeam/prove/blind.py", "simulators/__main__.py", "simulators/serve.py"}


class MovedError(AcquisitionError):
    """In place of a motion."""


def moves(*_: object, **__: object) -> None:
    raise MovedError("the arm moved")


class Gate:
    state = SimpleNamespace(value="")
    run = staticmethod(moves)

    def plan(self, *_: object) -> None: ...


class Robot:
    arm = None
    supervisor = SimpleNamespace(check=None)

    def __enter__(self) -> "Robot":
        return self

    def __exit__(self, *_: object) -> None: ...

    def joints(self) -> np.ndarray:
        return np.zeros(6)


@pytest.fixture
def quick(monkeypatch) -> None:
    """A person who needs no time to read, where nothing is typed between a question and its cue."""
    monkeypatch.setattr(asking, "REACTION_S", 0.0)


@pytest.fixture
def command(monkeypatch, tmp_path, quick) -> Callable[[str], list[str]]:
    """The command line of every command that asks, without any device: what would move the arm says so instead."""
    for name, stand_in in (
        ("streamed_robot", lambda *_: Robot()), ("gate_of", lambda *_: Gate()),
        ("draw_plan_file", lambda *_: None), ("said", lambda *_: "plan"),
    ):  # fmt: skip
        monkeypatch.setattr(by_hand, name, stand_in)
        monkeypatch.setattr(task_by_hand, name, stand_in)
    monkeypatch.setattr(on_site, "devices_ready", lambda *_: None)
    monkeypatch.setattr(WithDetectors, "_preview", lambda *_: None)
    monkeypatch.setattr(WithDetectors, "_measure", moves)
    monkeypatch.setattr("calibeam.devices.instruments.open_camera", moves)
    monkeypatch.setattr(centre, "connected", moves)
    monkeypatch.setattr(with_tracker, "connected_tracker", moves)
    write_pose_plan(tmp_path / "plan.toml", PosePlan(1, "ur5e-tracker", (PlannedBlock((PlannedPose((0.0,) * 6),)),)))
    psd = SimpleNamespace(connect=lambda: None, close=lambda: None)
    monkeypatch.setattr(psd_check, "psd_driver", lambda *_: psd)
    monkeypatch.setattr(psd_check, "_face", lambda *_: None)
    monkeypatch.setattr(psd_check, "collect", lambda psd, face, unit, place_m, ready: moves(ready(1, place_m[0])))
    (tmp_path / "points.csv").write_text("x_m,y_m\n0.001,0\n")
    (tmp_path / "task.toml").write_text(TASK)
    lines = {
        "move": ["move", str(RIG), "--home"],
        "jog": ["jog", str(RIG), "--axis", "z", "--by-mm", "5"],
        "task": ["task", "run", str(tmp_path / "task.toml"), "--rig", str(RIG), "--out", str(tmp_path)],
        "camera": ["camera", str(CAMERA_RIG), "--out", str(tmp_path / "camera")],
        "session": ["session", str(RIG), "--out", str(tmp_path / "session")],
        "centre": ["centre", str(RIG), "--out", str(tmp_path / "centre.mcap")],
        "tracker session": [
            "session",
            str(TRACKER_RIG),
            "--plan",
            str(tmp_path / "plan.toml"),
            "--out",
            str(tmp_path / "tracked"),
        ],
        "psd-check": ["psd-check", str(RIG), "--points", str(tmp_path / "points.csv")],
    }
    return lambda name: lines[name]


MOVING = ("move", "jog", "task", "camera", "session", "centre", "tracker session")


@pytest.mark.parametrize("name", MOVING)
def test_what_was_typed_ahead_moves_nothing(command, typist, capsys, name) -> None:
    typist.ahead("go\ny\n")
    typist.answers(CUE, "no\n")
    assert run(command(name)) == 1
    assert "nothing was moved: the answer was 'no'" in capsys.readouterr().err
    assert typist.asked == 0


@pytest.mark.parametrize("name", MOVING)
def test_the_word_after_the_question_moves_the_arm(command, typist, capsys, name) -> None:
    typist.answers(CUE, "Go\n")
    assert run(command(name)) == 1
    assert "the arm moved" in capsys.readouterr().err


def test_an_enter_typed_ahead_measures_no_place(command, typist, capsys) -> None:
    typist.ahead("\n\n")
    typist.answers(PLACE_CUE, "q\n")
    assert run(command("psd-check")) == 1
    assert "the check was ended at place 1; nothing was written" in capsys.readouterr().err


def test_enter_after_the_question_measures_the_place(command, typist, capsys) -> None:
    typist.answers(PLACE_CUE, "yes\n", "\n")
    assert run(command("psd-check")) == 1
    assert "the arm moved" in capsys.readouterr().err
    assert "'yes' is no answer" in typist.screen


TAUGHT = """[transform]
P = { untaught = true }
Q = { untaught = true }
[position]
"at pin" = "T6 = P"
"at hole" = "T6 = Q"
[[teach]]
transform = "P"
at = "at pin"
[[teach]]
transform = "Q"
at = "at hole"
"""


@pytest.fixture
def teach(monkeypatch, tmp_path, quick) -> list[str]:
    """Two positions to be taught, on an arm of which every reading is another one."""
    (tmp_path / "untaught.toml").write_text(TAUGHT)
    readings = iter(np.full(6, 0.1 * k) for k in range(9))
    monkeypatch.setattr(task_by_hand, "watched_joints", lambda *_: nullcontext(lambda: next(readings)))
    words = [
        "task",
        "teach",
        str(tmp_path / "untaught.toml"),
        "--rig",
        str(RIG),
        "--out",
        str(tmp_path / "taught.toml"),
    ]
    return words


def test_an_enter_typed_ahead_teaches_nothing(teach, typist, capsys, tmp_path) -> None:
    typist.ahead("\n\n")
    typist.answers(PLACE_CUE, "q\n")
    assert run(teach) == 1
    assert "teaching ended before 'at pin'" in capsys.readouterr().err
    assert not (tmp_path / "taught.toml").exists()


def test_enters_pasted_at_the_first_position_teach_no_second_one(teach, typist, capsys, tmp_path) -> None:
    typist.answers(PLACE_CUE, "\n\n\n", "q\n")
    assert run(teach) == 1
    assert "teaching ended before 'at hole'; what was taught until then is kept" in capsys.readouterr().err
    assert (tmp_path / "taught.toml").read_text().count("untaught") == 1
    assert typist.asked == 0


@pytest.mark.parametrize("name", [*MOVING, "psd-check"])
def test_without_a_terminal_nobody_is_asked(command, monkeypatch, capsys, tmp_path, name) -> None:
    (tmp_path / "answers").write_text("go\ny\n\n")
    for source in (os.devnull, tmp_path / "answers", None):  # None: closed before the program began
        with nullcontext() if source is None else Path(source).open() as standard_input:
            monkeypatch.setattr(sys, "stdin", standard_input)
            assert run(command(name)) == 1
        said = capsys.readouterr().err.splitlines()
        assert len(said) == 1
        assert said[0].startswith("error: nobody can be asked")
        assert "--no-wait" in said[0] if name == "psd-check" else "--yes" in said[0]


@pytest.mark.parametrize("name", MOVING)
def test_yes_and_a_dry_run_ask_nobody(command, monkeypatch, capsys, name) -> None:
    with Path(os.devnull).open() as standard_input:
        monkeypatch.setattr(sys, "stdin", standard_input)
        assert run([*command(name), "--yes"]) == 1
        assert "the arm moved" in capsys.readouterr().err
        if name in ("move", "jog"):
            assert run([*command(name), "--dry-run"]) == 0


@pytest.mark.parametrize("name", MOVING)
def test_the_end_of_input_is_a_refusal(command, typist, capsys, name) -> None:
    typist.answers(CUE, "\x04")
    assert run(command(name)) == 1
    said = capsys.readouterr().err
    assert said == "error: nothing was moved: the input ended without an answer\n"


@pytest.mark.parametrize("word", ["n", "No", "q"])
def test_a_plain_word_refuses(typist, word) -> None:
    typist.answers(CUE, f"{word}\n")
    with pytest.raises(NotAgreedError, match=f"nothing was moved: the answer was '{word.lower()}'"):
        Asking(typist.terminal).may_move()


def test_anything_else_asks_again(typist, quick) -> None:
    typist.answers(CUE, "y\n", "\n", "going\n", "\x1b[A\n", "go\n")
    Asking(typist.terminal).may_move()
    assert typist.asked == 0
    assert typist.screen.count(CUE) == 5
    assert "'y' is no answer" in typist.screen


def test_a_pasted_text_answers_one_question_only(typist) -> None:
    typist.answers(CUE, "x\ngo\ngo\n", "no\n")
    with pytest.raises(NotAgreedError):
        Asking(typist.terminal).may_move()
    assert typist.asked == 0


def test_what_is_typed_between_question_and_cue_is_no_answer(typist) -> None:
    typist.answers(asking.CELL, "go\n")
    typist.answers(CUE, "no\n")
    with pytest.raises(NotAgreedError):
        Asking(typist.terminal).may_move()


def test_a_terminal_that_goes_is_a_refusal(typist, monkeypatch) -> None:
    monkeypatch.setattr(Asking, "wait_until_seen", lambda _: typist.leave())
    with pytest.raises(NotAgreedError, match="the input ended"):
        Asking(typist.terminal).may_move()


def test_a_question_that_cannot_be_shown_is_a_refusal(typist, monkeypatch) -> None:
    """A word that is typed is no answer then."""

    def gone(_: Asking) -> int:
        raise OSError("no terminal")

    monkeypatch.setattr(Asking, "_screen", gone)
    typist.ahead("go\n")
    with pytest.raises(NotAgreedError, match="the input ended"):
        Asking(typist.terminal).may_move()


def test_a_terminal_that_can_only_be_read_shows_the_question_all_the_same(typist) -> None:
    typist.answers(CUE, "go\n")
    reading = os.open(os.ttyname(typist.terminal), os.O_RDONLY | os.O_NOCTTY)
    try:
        Asking(reading).may_move()
    finally:
        os.close(reading)


def test_a_choice_is_one_of_its_letters_or_enter_for_the_first_offered(typist, quick) -> None:
    asks, choices = Asking(typist.terminal), {"f": "finish", "n": "a further place"}
    typist.answers("what next? [f/n, ENTER: f] ", "x\n", "N\n", "\n", "\x04")
    assert [asks.choice("what next?", choices, "f") for _ in range(3)] == ["n", "f", None]
    assert "'x' is none of them" in typist.screen


def test_numbers_are_asked_for_until_they_are_numbers(typist, quick) -> None:
    asks = Asking(typist.terminal)
    typist.answers("> ", "1 2 3\n", "1 two\n", "1 nan\n", "1, -2.5\n", "\x04")
    assert [asks.numbers("where?", 2) for _ in range(2)] == [(1.0, -2.5), None]
    assert typist.screen.count("2 numbers, please") == 3


def test_nothing_else_reads_what_a_person_types() -> None:
    """No other module prompts; those that may read standard input are fed by a program."""
    asks, reads, prompts = set(), set(), set()
    for path in sorted(file for folder in PRODUCT for file in (ROOT / folder).rglob("*.py")):
        name = path.relative_to(ROOT).as_posix()
        text = path.read_text(encoding="utf-8")
        if not any(word in text for word in ("asking", "stdin", *PROMPTERS)):
            continue  # parsing all takes seconds
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom) and node.module == "calibeam.asking":
                asks.add(name)
            modules = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            modules += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if PROMPTERS & set(modules):
                prompts.add(name)
            if isinstance(node, ast.Call) and _prompts(node.func):
                prompts.add(name)
            if isinstance(node, ast.Attribute) and ast.unparse(node) == "sys.stdin":
                reads.add(name)
    assert prompts == set()
    assert reads == {"calibeam/asking.py"} | FED
    assert asks == ASKS


def _prompts(called: ast.expr) -> bool:
    """`input(...)`, or the method of a rich console."""
    if isinstance(called, ast.Name):
        return called.id == "input"
    return isinstance(called, ast.Attribute) and called.attr == "input"


class FreezingClock:
    """The program is frozen once, at its third look at the clock after a cue; `meanwhile` happens in the freeze."""

    def __init__(self, meanwhile: Callable[[], None]) -> None:
        self._meanwhile, self._looks, self._t_s = meanwhile, 0, 0.0

    def now_s(self) -> float:
        self._looks += 1
        if self._looks == 3:
            self._meanwhile()
            self._t_s += 5.0
        return self._t_s

    def sleep_s(self, seconds: float) -> None: ...


def test_what_is_typed_while_the_program_is_frozen_is_no_answer(typist) -> None:
    typist.answers(CUE, "", "no\n")
    clock = FreezingClock(lambda: typist.ahead("go\n"))
    with pytest.raises(NotAgreedError, match="the answer was 'no'"):
        Asking(typist.terminal, clock).may_move()
    assert f"This program did not run for 5.0 s; what was typed does not count. {asking.CELL}" in typist.screen


def test_who_waits_no_longer_leaves_the_keyboard_to_the_next_one(typist) -> None:
    over: list[bool] = []
    clock = FreezingClock(lambda: over.append(True))
    assert Asking(typist.terminal, clock).ask("held", "> ", lambda: bool(over)) is None
    typist.ahead("x\n")
    assert os.read(typist.terminal, 16) == b"x\n"
