"""Targets that are easily overlooked: each is corrected, or listed with its line, and none is taken for another."""

import pytest

from calibrate.apply.programs.literal import Targets
from calibrate.apply.programs.rewriting import dialect_of

POSE = "X = {} mm, Y = 0 mm, Z = 0 mm, W = 0 deg, P = 0 deg, R = 0 deg"


def found(text: str, suffix: str) -> Targets:
    dialect = dialect_of(suffix)
    assert dialect is not None
    return dialect.find(text, 6)


def lines(targets: Targets) -> list[int]:
    """Of what is left as it is."""
    return sorted(int(sentence.split(":")[0].removeprefix("line ")) for sentence in targets.skipped)


def fanuc(moves: str, *positions: str) -> Targets:
    listing = "".join(f"P[{k}]{{\n{position}\n}};\n" for k, position in enumerate(positions, start=1))
    return found(f"/MN\n{moves}/POS\n{listing}/END\n", ".ls")


def group(n: int, fields: str, uf: int = 0) -> str:
    return f"   GP{n}:\n\tUF : {uf}, UT : 0,\n\t{fields}\n"


POSITIONER = "J1 = 11.000 deg, J2 = 12.000 deg"
JOINTS = ", ".join(f"J{j} = {j}.000 deg" for j in range(1, 7))


def test_fanuc_numbers_of_a_positioner_are_not_those_of_the_arm() -> None:
    (one,) = fanuc("1:L P[1] 50mm/sec FINE ;\n", group(1, POSE.format(5), 3) + group(2, POSITIONER, 4)).literals
    assert one.numbers[0] == 5.0
    assert one.used[0][0].name == "UF 3"
    (joints,) = fanuc("1:J P[1] 100% FINE ;\n", group(1, JOINTS) + group(2, POSITIONER)).literals
    assert joints.numbers == (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)


@pytest.mark.parametrize("position", [group(1, POSE.format(5)) + group(2, POSE.format(6)), group(2, POSE.format(6))])
def test_fanuc_positions_of_another_arm_are_listed(position: str) -> None:
    targets = fanuc("1:L P[1] 50mm/sec FINE ;\n", position)
    assert not targets.literals
    assert lines(targets) == [4]


@pytest.mark.parametrize(
    "move",
    [
        "L P[1] 50mm/sec FINE Offset",
        "L P[1] 50mm/sec FINE Offset,PR[2]",
        "L P[1] 50mm/sec FINE Tool_Offset,PR[2]",
        "L P[1] 50mm/sec FINE INC",
        "C P[2]\n:  P[1] 50mm/sec FINE\n: VOFFSET,VR[1]",
        "L P[1] 50mm/sec FINE COORD",
    ],
)
def test_fanuc_moves_with_an_offset_are_listed_and_their_points_stay(move: str) -> None:
    targets = fanuc(f"1:{move} ;\n", group(1, POSE.format(5)), group(1, POSE.format(6)))
    assert "P[1]" not in [one.name for one in targets.literals]
    assert lines(targets)[-1] == (3 if "C P" in move else 2)
    both = fanuc(f"1:{move} ;\n2:J P[1:no Offset] 100% FINE ;\n", group(1, POSE.format(5)), group(1, POSE.format(6)))
    assert both.literals[0].name == "P[1]"
    assert both.skipped == targets.skipped


def test_fanuc_positions_that_are_chosen_at_run_time_or_absent_are_listed() -> None:
    targets = fanuc(
        "1:L P[R[1]] 50mm/sec FINE ;\n2:L P[1] 50mm/sec FINE ;\n3:J P[7] 9% FINE ;\n", group(1, POSE.format(5))
    )
    assert [one.name for one in targets.literals] == ["P[1]"]
    assert lines(targets) == [2, 4]


KRL = "{X 1, Y 0, Z 0, A 0, B 0, C 0}"
UR = "p[1, 0, 0, 0, 0, 0]"
ABB = "[[1,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
REST = "v50, fine, tool0;\n"
CASES = {  # text, targets that are corrected, lines that are listed
    "KRL SPL": (".src", f"SPLINE\nSPL {KRL}\nSPL XP1\nENDSPLINE\nDECL E6POS XP1={KRL}\n", ["line 2", "XP1"], []),
    "KRL SPL_REL": (".src", "SPLINE\nSPL_REL {Z 50}\nENDSPLINE\n", [], [2]),
    "KRL literal with offset": (".src", f"LIN {KRL} : {{Z 50}}\n", [], [1]),
    "KRL point with offset": (".src", f"DECL POS XP1={KRL}\nLIN XP1:{{Z 50}}\nLIN XP1\n", ["XP1"], [2]),
    "KRL expressions": (".src", "LIN {X a[1], Y 0}\n" + f"LIN {KRL}\n".replace("X 1", "X 1+d"), [], [1, 2]),
    "KRL computed point": (".src", f"DECL POS XP1={KRL}\nXP1.Z = 5\nXP1 = XP2\nLIN XP1\n", ["XP1"], [2, 3]),
    "KRL arc": (".src", f"CIRC XP1:{{Z 5}}, {KRL}\n", ["line 1"], [1]),
    "UR computed": (".script", f"movel(pose_add({UR}, {UR}))\nb = pose_trans({UR}, {UR})\nmovel(b)\n", [], [1, 2, 3]),
    "UR changed": (".script", f"a = {UR}\na = pose_trans(a, {UR})\na[2] = 0.5\nmovel(a)\n", ["a"], [2, 3]),
    "UR expressions": (".script", "movel(p[x, 0, 0, 0, 0, 0])\nmovej([d2r(10), 0, 0, 0, 0, 0])\n", [], [1, 2]),
    "UR list": (".script", f"w = [{UR}, pose_add(w, {UR}),\n{UR}]\nmovel(w[2])\nmovel(w[0])\n", ["w[0]"], [1, 2, 3]),
    "UR arc": (".script", f"movec(pose_trans(a, {UR}), {UR})\n", ["line 1"], [1]),
    "RAPID Offs of a literal": (".mod", f"MoveL Offs({ABB},0,0,5), {REST}", [], [1]),
    "RAPID RelTool": (
        ".mod",
        f"CONST robtarget p1 := {ABB};\nMoveL RelTool(p1,0,0,5), {REST}MoveL p1, {REST}",
        ["p1"],
        [2],
    ),
    "RAPID arc": (".mod", f"MoveC Offs(p1,0,0,5), {ABB}, {REST}", ["line 1"], [1]),
    "RAPID parts": (".mod", f"MoveL [p1.trans, p1.rot, p1.robconf, p1.extax], {REST}", [], [1]),
    "RAPID computed": (
        ".mod",
        f"VAR robtarget p1 := {ABB};\np1.trans.z := 5;\np1 := p2;\nMoveL p1, {REST}",
        ["p1"],
        [2, 3],
    ),
}


@pytest.mark.parametrize(("suffix", "text", "corrected", "listed"), CASES.values(), ids=CASES)
def test_targets_with_an_offset_or_computed_ones_are_listed(
    suffix: str, text: str, corrected: list[str], listed: list[int]
) -> None:
    targets = found(text, suffix)
    assert [one.name for one in targets.literals] == corrected
    assert sorted(set(lines(targets))) == listed
