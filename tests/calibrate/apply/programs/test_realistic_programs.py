"""Programs as they are in a plant: arcs, arrays, frames, routines; every target is corrected, or listed and counted."""

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibeam.cli import run
from calibrate.apply.correct.corrected import Options
from calibrate.apply.programs.rewriting import correct_program, dialect_of
from calibrate.errors import DataError
from calibrate.model.model_file import write_model
from tests.calibrate.apply.correct.six_joints import drawn, inverse, model, postures, real

NUMBER = re.compile(r"-?\d+\.\d+")
CONFIGURATION = re.compile(r"\[-?\d,-?\d,-?\d,0\],\[9E9")  # follows an axis that the correction takes over an edge
Q = postures(8, seed=11)
T = drawn().frames(Q)[:, -1]
TOOL = np.eye(4)


def mm(i):
    return [f"{1e3 * v:.4f}" for v in T[i, :3, 3]]


def kuka(i):
    a, b, c = Rotation.from_matrix(T[i, :3, :3]).as_euler("ZYX", degrees=True)
    bits = sum(1 << j for j in range(6) if Q[i, j] < 0.0)
    x, y, z = mm(i)
    return f"{{X {x}, Y {y}, Z {z}, A {a:.6f}, B {b:.6f}, C {c:.6f}, S 2, T {bits}}}"


def abb(i):
    x, y, z, w = Rotation.from_matrix(T[i, :3, :3]).as_quat()
    quarters = ",".join(str(int(np.floor(Q[i, j] / (np.pi / 2)))) for j in (0, 3, 5))
    turn = ",".join(f"{v:.9f}" for v in (w, x, y, z))
    return f"[[{','.join(mm(i))}],[{turn}],[{quarters},0],[9E9,9E9,9E9,9E9,9E9,9E9]]"


def fanuc(i):
    r, p, w = Rotation.from_matrix(T[i, :3, :3]).as_euler("ZYX", degrees=True)
    place = ", ".join(f"{k} = {v} mm" for k, v in zip("XYZ", mm(i), strict=True))
    return f"{place},\n\tW = {w:.4f} deg, P = {p:.4f} deg, R = {r:.4f} deg"


def ur(i):
    turn = Rotation.from_matrix(T[i, :3, :3]).as_rotvec()
    return "p[" + ", ".join(f"{v:.8f}" for v in [*T[i, :3, 3], *turn]) + "]"


SRC = f"""&ACCESS RVP
DEF weld()
  BAS (#BASE, 0)
  $TOOL = {{X 0.000, Y 0.000, Z 0.000, A 0.000, B 0.000, C 0.000}}
  PTP XHOME
  PTP XP1
  LIN P[1] C_DIS
  CIRC P[2], {kuka(3)}
  FOR I = 1 TO 2
    LIN P[I]
  ENDFOR
  SCIRC {kuka(4)}, XP2
  LIN_REL {{Z 50.000}}
END
"""
DAT = f"""DEFDAT weld
  DECL E6AXIS XHOME = {{A1 0.000, A2 -90.000, A3 90.000, A4 0.000, A5 90.000, A6 0.000}}
  DECL E6POS XP1 = {kuka(0)}
  DECL E6POS P[2]
  P[1] = {kuka(1)}
  P[2] = {kuka(2)}
  DECL E6POS XP2 = {kuka(5)}
ENDDAT
"""
MOD = f"""MODULE weld
  PERS wobjdata table := [FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  CONST robtarget seam{{2}} := [{abb(0)}, {abb(1)}];
  CONST robtarget p10 := {abb(2)};
  CONST jointtarget home := [[0,-20,20,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveAbsJ home, v200, z10, tool0;
    approach;
    ArcCStart {abb(3)}, {abb(4)}, v50, sm1, wd1, fine, tool0\\WObj:=table;
    ArcCEnd p10, {abb(5)}, v50, sm1, wd1, fine, tool0\\WObj:=table;
    FOR i FROM 1 TO 2 DO
      MoveL seam{{i}}, v50, fine, tool0\\WObj:=table;
    ENDFOR
    MoveL Offs(p10, 0, 0, 50), v50, fine, tool0\\WObj:=table;
  ENDPROC
  PROC approach()
    MoveJ {abb(6)}, v200, z10, tool0\\WObj:=table;
    MoveC {abb(7)}, p10, v50, z1, tool0\\WObj:=table;
  ENDPROC
ENDMODULE
"""
LS = (
    """/PROG  WELD
/MN
   1:  UFRAME_NUM=0 ;
   2:J P[1] 100% FINE    ;
   3:L P[2] 50mm/sec FINE    ;
   4:C P[3]
    :  P[4] 50mm/sec FINE    ;
   5:L PR[1] 50mm/sec FINE    ;
/POS
"""
    + "".join(
        f"P[{k + 1}]{{\n   GP1:\n\tUF : 0, UT : 0,\t\tCONFIG : 'N U T, 0, 0, 0',\n\t{fanuc(k)}\n}};\n" for k in range(4)
    )
    + "/END\n"
)
SCRIPT = f"""def weld():
  set_tcp(p[0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
  path = [{ur(0)},
    {ur(1)}]
  over = {ur(2)}
  def seam():
    movel(over, a=1.2, v=0.25)
    movec({ur(3)}, {ur(4)}, a=1.2, v=0.05)
    movec(over, pose_to={ur(5)})
  end
  movej([0.1, -1.2, 1.3, 0.2, 1.1, 0.0])
  i = 0
  while i < 2:
    movel(path[i])
    i = i + 1
  end
  movel(pose_trans(over, p[0.0, 0.0, -0.01, 0.0, 0.0, 0.0]))
end
"""
PROGRAMS = {  # text, targets corrected, left, joint targets, m that rounding costs
    ".src": (SRC + DAT, 6, 1, 1, 2e-6),
    ".mod": (MOD, 8, 1, 1, 2e-6),
    ".ls": (LS, 4, 1, 0, 5e-5),
    ".script": (SCRIPT, 6, 1, 1, 2e-6),
}


def corrected(text, suffix, **options):
    options = Options(tool=TOOL, **options)
    return correct_program(model(), text, dialect_of(suffix), None, Q[0], {}, inverse(), options, "weld" + suffix)


def masked(text):
    return CONFIGURATION.sub("[cf],[9E9", NUMBER.sub("#", text))


@pytest.mark.parametrize("suffix", PROGRAMS)
def test_every_target_is_corrected_or_counted_and_nothing_else_changes(suffix):
    text, count, left, kept, _ = PROGRAMS[suffix]
    done = corrected(text, suffix)
    assert (len(done.names), len(done.skipped), len(done.kept)) == (count, left, kept), done.skipped
    assert np.isfinite(done.found.q_rad).all()
    assert masked(done.text) == masked(text)


@pytest.mark.parametrize("suffix", PROGRAMS)
def test_the_real_arm_reaches_every_target_as_well_as_is_printed(suffix):
    text, _, _, _, close_m = PROGRAMS[suffix]
    found = corrected(text, suffix).found
    apart = [np.max(np.abs(T - drawn().frames(q[None])[0, -1]), axis=(1, 2)) for q in found.nominal_rad]
    assert np.max(np.min(apart, axis=1)) < 5e-5
    wanted = T[np.argmin(apart, axis=1)]
    off = np.linalg.inv(real().frames(found.q_rad)[:, -1]) @ wanted
    spread_m = np.linalg.norm(off[:, :3, 3] - off[:, :3, 3].mean(axis=0), axis=1)
    assert np.sqrt(np.mean(spread_m**2)) <= 1.25 * max(found.after.rms_m, close_m)
    assert found.before.rms_m > 10.0 * np.sqrt(np.mean(spread_m**2))


def test_joint_targets_are_corrected_on_request():
    done = corrected(MOD, ".mod", joint_targets=True)
    assert "home" in done.names
    assert not done.kept
    with pytest.raises(DataError, match="--joint-targets"):
        corrected("def a():\n  movej([0.1, -1.2, 1.3, 0.2, 1.1, 0.0])\nend\n", ".script")


def test_a_joint_target_that_stays_is_the_posture_before_the_next():
    """Far from the middle of the range, from which another branch would be nearer."""
    text = f"movej([{', '.join(f'{v:.6f}' for v in Q[4])}])\nmovel({ur(4)})\n"
    done = correct_program(
        model(), text, dialect_of(".script"), None, -Q[4], {}, inverse(), Options(tool=TOOL), "weld.script"
    )
    np.testing.assert_allclose(done.found.nominal_rad[0], Q[4], atol=1e-4)


def test_a_seam_that_begins_corrected_and_goes_on_as_it_was_is_named():
    text = f"movel({ur(0)})\nmovel({ur(1)})\nmovel(pose_trans({ur(1)}, p[0.0, 0.0, 0.1, 0.0, 0.0, 0.0]))\n"
    done = corrected(text, ".script")
    assert any(seam.startswith("lines 2 and 3:") for seam in done.warnings)
    assert not corrected(text.replace("movel(pose_trans", "movej(pose_trans"), ".script").warnings


def test_a_routine_of_another_file_is_a_warning_only():
    text = f"BAS(#BASE, 0)\nGRIP()\nPTP {kuka(0)}\n"
    done = corrected(text, ".src")
    assert (len(done.names), done.skipped, len(done.warnings)) == (1, (), 1)
    assert done.warnings[0].startswith("line 2: GRIP ")


def test_an_assignment_between_two_moves_is_no_seam():
    text = f"a = {ur(0)}\nmovel(a)\na[2] = 0.1\nmovel({ur(1)})\n"
    done = corrected(text, ".script")
    assert done.skipped[0].startswith("line 3:")
    assert not done.warnings


def test_a_target_of_an_instruction_that_nobody_knows_is_listed():
    text = f"MODULE a\n  PROC main()\n    MoveL {abb(0)}, v50, fine, tool0;\n    Glue {abb(1)};\n  ENDPROC\nENDMODULE"
    done = corrected(text, ".mod")
    assert len(done.names) == len(done.skipped) == 1
    assert done.skipped[0].startswith("line 4:")


def test_a_data_list_is_corrected_with_its_program(tmp_path, capsys):
    write_model(tmp_path / "model.json", model())
    (tmp_path / "weld.src").write_text(SRC)
    (tmp_path / "weld.dat").write_text(DAT)
    given = ["correct", str(tmp_path / "model.json"), str(tmp_path / "weld.src"), "--tool", *"000000"]
    assert run([*given, "--out", str(tmp_path / "new.src"), "--start", *map(str, np.degrees(Q[0]))]) == 3
    for name, was in (("new.src", SRC), ("new.dat", DAT)):
        text = (tmp_path / name).read_text()
        assert text != was
        assert NUMBER.sub("#", text) == NUMBER.sub("#", was)
    assert "6 of 7" in capsys.readouterr().out
    assert run([*given, "--out", str(tmp_path / "weld.SRC.src")]) in (0, 3)
    assert run([*given, "--out", str(tmp_path / "weld.src")]) == 1


BASE = "  $BASE = {X 100.000, Y 0.000, Z 0.000, A 0.000, B 0.000, C 0.000}\n"
OTHER = BASE.replace("100.000", "200.000")


@pytest.mark.parametrize(("second", "count"), [(BASE, 1), (OTHER, 0)])
def test_a_routine_has_the_base_of_its_callers_where_they_agree(second, count):
    text = f"DEF main()\n{BASE}  seam()\n{second}  seam()\nEND\nDEF seam()\n  LIN {kuka(0)}\nEND\n"
    if count:
        assert corrected(text, ".src").frames[0][0, 3] == pytest.approx(0.1)
    else:
        with pytest.raises(DataError, match="not the same at all calls"):
            corrected(text, ".src")


def points(*names):
    return "".join(f"DECL E6POS {name} = {kuka(k)}\n" for k, name in enumerate(names))


WITHIN_PATHS = {  # text, line of the move before which nothing can be inserted
    "circ": (".src", f"BAS(#BASE, 0)\nPTP {kuka(0)}\nCIRC {kuka(1)}, {kuka(2)}\n", 3),
    "points of circ": (".src", f"BAS(#BASE, 0)\nSCIRC XP1, XP2\n{points('XP1', 'XP2')}", 2),
    "end of circ": (".src", f"BAS(#BASE, 0)\nCIRC XP7, {kuka(2)}\n", 2),
    "spline": (".src", f"BAS(#BASE, 0)\nSPLINE\nSLIN {kuka(0)}\nENDSPLINE\n", 3),
    "index": (".src", f"BAS(#BASE, 0)\nDECL POS P[2]\nP[1] = {kuka(0)}\nP[2] = {kuka(1)}\nLIN P[I]\n", 5),
    "movec": (".script", f"movel({ur(0)})\nmovec({ur(1)}, {ur(2)})\n", 2),
    "MoveC": (".mod", f"MoveL {abb(0)}, v50, fine, tool0;\nMoveC {abb(1)}, {abb(2)}, v50, fine, tool0;\n", 2),
    "IF": (".mod", f"MoveL {abb(0)}, v50, fine, tool0;\nIF di1 = 1 MoveL {abb(1)}, v50, fine, tool0;\n", 2),
    "IF of two lines": (".mod", f"IF di1 = 1 ! then; go\n  MoveL {abb(1)}, v50, fine, tool0;\n", 2),
    "IF of a point": (".mod", f"IF a MoveL p9, v50, fine, tool0;\nCONST robtarget p9 := {abb(1)};\n", 1),
    "after another": (".mod", f"Set do1; MoveL {abb(1)}, v50, fine, tool0;\n", 1),
    "if": (".script", f"if a: movel({ur(0)}) end\n", 1),
    "ArcCStart": (".mod", f"ArcCStart p1, {abb(2)}, v50, sm1, wd1, fine, tool0;\n", 1),
}


@pytest.mark.parametrize(("suffix", "text", "line"), WITHIN_PATHS.values(), ids=WITHIN_PATHS)
def test_no_overshoot_is_inserted_into_an_arc_or_a_spline(suffix, text, line):
    assert corrected(text, suffix).names
    with pytest.raises(DataError, match=rf"line {line}: no overshoot point can stand before a move .*--approach"):
        corrected(text, suffix, approach=1)


def test_overshoots_stand_within_the_branch_of_an_if():
    move = f"  MoveL {abb(0)}, v50, fine, tool0;\n"
    text = f"IF di1 = 1 THEN\n{move}ELSEIF di2 = 1 THEN\n{move}ELSE\n{move}ENDIF\n! only if\n{move}"
    added = corrected(text, ".mod", approach=1).text.splitlines()
    assert [k for k, line in enumerate(added) if "MoveAbsJ" in line] == [1, 4, 7, 11]


def test_overshoots_stand_before_lines_next_to_a_spline():
    text = f"BAS(#BASE, 0)\nSPLINE\nSLIN XP9\nENDSPLINE\nLIN {kuka(0)} ; CIRC comes next\nCIRC XP7, XP8\n"
    done = corrected(text, ".src", approach=1)
    assert done.text.splitlines()[4].startswith("PTP {A1")
    assert len(done.text.splitlines()) == len(text.splitlines()) + 1
