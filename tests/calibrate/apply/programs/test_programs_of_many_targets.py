"""Programs of thousands of targets: the work for one does not grow with the number of the others."""

import re
from collections import Counter
from typing import Any

import numpy as np
import pytest

from calibrate.apply.correct.corrected import (
    MOST_POSES,
    Options,
    Wanted,
    correct,
)
from calibrate.apply.correct.tables import read_poses
from calibrate.apply.programs import (
    krl,
    literal,
    rapid,
    urscript,
)
from calibrate.apply.programs.literal import (
    LONGEST_MOVE,
    NUMBER,
    Dialect,
    line_of,
)
from calibrate.apply.programs.rewriting import DIALECTS
from calibrate.errors import DataError

MANY = 300
KRL = "DEF a()\n" + "$BASE = {X 1, Y 0, Z 0, A 0, B 0, C 0}\nLIN {X 1, Y 2, Z 3, A 0, B 0, C 0}\n" * MANY + "END\n"
URSCRIPT = "set_tcp(p[0, 0, 1, 0, 0, 0])\nmovel(p[1, 2, 3, 0, 0, 0])\n" * MANY


@pytest.mark.parametrize(("text", "module", "suffix"), [(KRL, krl, ".src"), (URSCRIPT, urscript, ".script")])
def test_each_frame_and_tool_is_read_once(text: str, module: Any, suffix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    made: Counter[str] = Counter()
    frame = Dialect.frame

    def counted(self: Dialect, numbers: Any) -> Any:
        made[self.name] += 1
        return frame(self, numbers)

    monkeypatch.setattr(Dialect, "frame", counted)
    dialect = next(one for one in DIALECTS if suffix in one.suffixes)
    found = dialect.find(text, 6)
    assert len(found.literals) == MANY
    assert sum(made.values()) <= 2 * MANY


def test_the_frame_is_the_one_set_last_above_in_the_routine() -> None:
    text = (
        "DEF a()\n$BASE = {X 1000, Y 0, Z 0, A 0, B 0, C 0}\nLIN {X 1, Y 0, Z 0, A 0, B 0, C 0}\n"
        "$BASE = {X 2000, Y 0, Z 0, A 0, B 0, C 0}\nLIN {X 2, Y 0, Z 0, A 0, B 0, C 0}\nEND\n"
        "DEF b()\nLIN {X 3, Y 0, Z 0, A 0, B 0, C 0}\nEND\n"
    )
    frames = [one.used[0][0].T for one in krl.find(text, 6).literals]
    assert [None if T is None else float(T[0, 3]) for T in frames] == [1.0, 2.0, None]


def test_assignments_of_a_module_are_counted_in_one_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    tool = "PERS tooldata t{}:=[TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\n"
    text = "".join(tool.format(k) for k in range(MANY)) + "t7.tframe := t8.tframe;\n"
    monkeypatch.setattr("re.findall", None)
    assert rapid.find(text, 6).literals == ()


def test_a_move_without_an_end_does_not_take_the_rest_of_the_program() -> None:
    text, nothing = "MoveL a\n" * MANY, (literal.NamedPose(), literal.NamedPose())

    def places(at: int) -> tuple[literal.NamedPose, literal.NamedPose]:
        return nothing

    moves = literal.moves_of(text, text, (rapid.MOVE,), places, ";")
    assert max(len(move.text) for move in moves["a"]) <= LONGEST_MOVE + len("MoveL a\n")


@pytest.mark.parametrize("at", [0, 1, 2, 3, 4, 5])
def test_lines_are_counted_from_one(at: int) -> None:
    text = "a\n\nbc\n"
    assert line_of(text, at) == text.count("\n", 0, at) + 1


@pytest.mark.parametrize(
    ("text", "whole"), [("-1.5e3", True), (".5", True), ("1.", True), ("1" * 100_000 + "x", False)]
)
def test_a_number_is_read_once(text: str, whole: bool) -> None:
    """Not again from every digit on, which would take minutes."""
    assert bool(re.fullmatch(rf"(?:{NUMBER})+", text) if len(text) < 10 else re.match(rf"{NUMBER}\s*,", text)) is whole


def test_more_poses_than_are_corrected_at_a_time_are_refused() -> None:
    n = MOST_POSES + 1
    empty = np.empty((n, 0))
    wanted = Wanted(np.broadcast_to(np.eye(4), (n, 4, 4)), empty, empty, {}, source="weld.mod")
    nothing: Any = None
    with pytest.raises(
        DataError, match=r"weld\.mod: 3001 poses; at most 3000 are corrected at a time, split it into parts"
    ):
        correct(nothing, wanted, nothing, Options())


def test_a_table_of_too_many_poses_is_named() -> None:
    text = "x_m,y_m,z_m,rx_rad,ry_rad,rz_rad\n" + "0.4,0.1,0.3,0,0,0\n" * (MOST_POSES + 1)
    wanted = read_poses(text, "poses.csv", 6, np.eye(4), {})
    nothing: Any = None
    with pytest.raises(DataError, match=r"poses\.csv: 3001 poses; at most 3000"):
        correct(nothing, wanted, nothing, Options())
