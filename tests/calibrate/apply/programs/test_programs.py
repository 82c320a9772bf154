"""Programs: only the numbers of targets change, and the controller that reads them brings the real arm to its pose."""

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

TOOL = np.eye(4)
NUMBER = re.compile(r"-?\d+\.\d{3,}")
UR = """def weld():
  # p[0.1, 0.2, 0.3, 0, 0, 0] is no target
  set_tcp(p[0.000000, 0.000000, 0.000000, 0.0, 0.0, 0.0])
  above = p[{0}]
  movej([{q}], a=1.4, v=1.05)
  movel(above, a=1.2, v=0.25)
  movel(pose_trans(above, p[0.0, 0.0, -0.010000, 0.0, 0.0, 0.0]))
  movel(p[{1}], v=0.10)
end
"""
KRL = """&ACCESS RVP\r
DEF weld()\r
  $TOOL = {{X 0.000, Y 0.000, Z 0.000, A 0.000, B 0.000, C 0.000}}\r
  $BASE = $NULLFRAME\r
  PTP {{{q}}} C_PTP\r
  LIN {{E6POS: {0}, S 2, T {t0}, E1 0.000}} C_DIS ; X 99.999\r
  PTP_REL {{X 10.000}}\r
  SLIN {{{1}, S 2, T {t1}}}\r
END\r
"""
RAPID = """MODULE weld
  PERS tooldata torch := [TRUE,[[0.000,0.000,0.000],[1,0,0,0]],[1.000,[0,0,1.000],[1,0,0,0],0,0,0]];
  CONST robtarget p10 := [[{0}],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget home := [[{q}],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveAbsJ home, v200, z10, torch;
    MoveJ p10, v200, z10, torch\\WObj:=wobj0;   ! p10
    MoveL [[{1}],[9E9,9E9,9E9,9E9,9E9,9E9]], v50, fine, torch;
  ENDPROC
ENDMODULE
"""
FANUC = """/PROG  WELD
/MN
   1:J P[1] 100% FINE    ;
   2:L P[2] 50mm/sec FINE    ;
   3:L PR[4] 50mm/sec FINE    ;
/POS
P[1]{{
   GP1:
\tUF : 0, UT : 1,
\t{q}
}};
P[2]{{
   GP1:
\tUF : {uf}, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',
\t{0}
}};
/END
"""
Q = postures(3)
T = drawn().frames(Q)[:, -1]


def listed(values, digits=7):
    return ", ".join(f"{v:.{digits}f}" for v in values)


def keyed(keys, values, form="{} {:.4f}", between=", "):
    return between.join(form.format(k, v) for k, v in zip(keys, values, strict=True))


def mm(i):
    return 1e3 * T[i, :3, 3]


def turned(i):
    """A, B, C of KUKA in degrees."""
    return Rotation.from_matrix(T[i, :3, :3]).as_euler("ZYX", degrees=True)


def bits(i):
    return sum(1 << j for j in range(6) if Q[i, j] < 0.0)


def ur():
    poses = [listed([*T[i, :3, 3], *Rotation.from_matrix(T[i, :3, :3]).as_rotvec()]) for i in (0, 1)]
    return UR.format(*poses, q=listed(Q[2]))


def krl():
    poses = [keyed("XYZABC", [*mm(i), *turned(i)], "{} {:.5f}") for i in (0, 1)]
    joints = keyed([f"A{j}" for j in range(1, 7)], np.degrees(Q[2]), "{} {:.6f}")
    return KRL.format(*poses, q=joints, t0=bits(0), t1=bits(1))


def rapid():
    poses = []
    for i in (0, 1):
        x, y, z, w = Rotation.from_matrix(T[i, :3, :3]).as_quat()
        quarters = [int(np.floor(Q[i, j] / (np.pi / 2))) for j in (0, 3, 5)]
        poses.append(f"{listed(mm(i), 4)}],[{listed([w, x, y, z], 9)}],[{','.join(map(str, quarters))},0")
    return RAPID.format(*poses, q=listed(np.degrees(Q[2]), 6))


def fanuc(frame=0):
    pose = keyed("XYZ", mm(1), "{} = {:.3f} mm") + ",\n\t" + keyed("WPR", turned(1)[::-1], "{} = {:.3f} deg")
    joints = keyed([f"J{j}" for j in range(1, 7)], np.degrees(Q[2]), "{} = {:.3f} deg")
    return FANUC.format(pose, q=joints, uf=frame)


def corrected(text, suffix, options=None, **fields):
    given = {"frame": None, "near_rad": Q[0], "every": {}} | fields
    return correct_program(
        model(),
        text,
        dialect_of(suffix),
        given["frame"],
        given["near_rad"],
        given["every"],
        inverse(),
        options or Options(tool=TOOL, joint_targets=True),
        "weld" + suffix,
    )


PROGRAMS = {  # text, m and rad that rounding of the literals may cost
    ".script": (ur, 2e-6),
    ".src": (krl, 2e-6),
    ".mod": (rapid, 2e-6),
    ".ls": (fanuc, 5e-5),
}


@pytest.mark.parametrize("suffix", PROGRAMS)
def test_only_numbers_of_targets_change(suffix):
    text = PROGRAMS[suffix][0]()
    done = corrected(text, suffix)
    assert NUMBER.sub("#", done.text) == NUMBER.sub("#", text)
    changed = [(a, b) for a, b in zip(text.splitlines(), done.text.splitlines(), strict=True) if a != b]
    assert len(changed) >= 2
    assert not [a for a, _ in changed if "TOOL" in a or "tooldata" in a or "set_tcp" in a or "pose_trans" in a]
    assert [line for line in done.diff if line.startswith("+") and not line.startswith("+++")] == [
        "+" + b for _, b in changed
    ]


@pytest.mark.parametrize("suffix", PROGRAMS)
def test_the_real_arm_reaches_what_the_program_wanted(suffix):
    """Every target's frame of the real flange is the wanted one, but for one constant motion in the flange."""
    make, close_m = PROGRAMS[suffix]
    done = corrected(make(), suffix)
    wanted = np.array([nearest(q) for q in done.found.nominal_rad])
    apart = np.linalg.inv(real().frames(done.found.q_rad)[:, -1]) @ wanted
    assert np.max(np.abs(apart - apart[0])) < close_m
    assert np.max(done.found.before.error_m) > 3e-4
    assert np.max(done.found.after.error_m) < close_m


def nearest(q):
    """(4, 4) of the pose that a target was made of: the dialect was read as it was written."""
    apart = np.max(np.abs(T - drawn().frames(q[None])[0, -1]), axis=(1, 2))
    assert np.min(apart) < 2e-5
    return T[int(np.argmin(apart))]


def test_skipped_moves_are_named():
    assert any("pose_trans" in says for says in corrected(ur(), ".script").skipped)
    assert any("PTP_REL" in says for says in corrected(krl(), ".src").skipped)
    assert any("position registers" in says for says in corrected(fanuc(), ".ls").skipped)


@pytest.mark.parametrize("suffix", [".script", ".src", ".mod"])
def test_overshoot_points_stand_before_their_moves(suffix):
    text = PROGRAMS[suffix][0]()
    done = corrected(text, suffix, Options(tool=TOOL, approach=1, joint_targets=True))
    words = {".script": "movej([", ".src": "PTP {A1", ".mod": "MoveAbsJ [["}[suffix]
    added = [line for line in done.text.splitlines() if line.strip().startswith(words)]
    had = [line for line in text.splitlines() if line.strip().startswith(words)]
    assert len(added) - len(had) == 3
    assert ("\r\n" in text) == ("\r\n" in done.text)
    if "\r\n" in text:
        assert "\n" not in done.text.replace("\r\n", "")
    assert np.allclose(done.found.q_rad - done.found.via_rad, np.radians(2.0), atol=1e-5)


def test_what_cannot_be_done_is_refused():
    with pytest.raises(DataError, match="overshoot points cannot be inserted"):
        corrected(fanuc(), ".ls", Options(tool=TOOL, approach=1, joint_targets=True))
    declared = krl().replace("  LIN {E6POS: ", "  DECL E6POS XP1 = {")
    with pytest.raises(DataError, match="no move in this file goes to XP1"):
        corrected(declared, ".src", Options(tool=TOOL, approach=1, joint_targets=True), frame=np.eye(4))
    with pytest.raises(DataError, match="no target"):
        corrected("DEF a()\nEND\n", ".src")


def test_a_frame_is_taken_into_account():
    """Coordinates in a frame that is half a metre off along x name other places of the base."""
    frame = np.eye(4)
    frame[0, 3] = 0.1
    in_base, in_frame = corrected(fanuc(), ".ls"), corrected(fanuc(3), ".ls", frame=frame)
    shift = in_frame.found.T_base_tool[1, :3, 3] - in_base.found.T_base_tool[1, :3, 3]
    assert np.allclose(shift, [0.1, 0.0, 0.0], atol=2e-3)


def test_a_configuration_that_no_posture_has_leaves_its_target_as_it_was():
    text = krl().replace(f"T {bits(1)}", f"T {bits(1) ^ 1}")
    done = corrected(text, ".src")
    assert done.found.status[-1] == "unreachable"
    assert "configuration" in done.found.says[-1]
    assert done.text.splitlines()[7] == text.splitlines()[7]


def test_a_target_without_a_command_has_no_error_on_the_terminal(tmp_path, capsys):
    write_model(tmp_path / "model.json", model())
    only = UR[: UR.index("movej")] + "movel(p[9.0,0.0,0.0,0.0,0.0,0.0], a=1, v=0.1)\nend\n"
    (tmp_path / "weld.script").write_text(only)
    out = str(tmp_path / "out.script")
    assert run(["correct", str(tmp_path / "model.json"), str(tmp_path / "weld.script"), "--out", out]) == 3
    printed = capsys.readouterr().out
    assert "predicted tool error not known (no command), corrected not known (no command)" in printed
    assert "0 of 1 poses corrected\n" in printed
    assert "nan" not in printed


@pytest.mark.parametrize("suffix", [".src", ".mod"])
def test_the_posture_is_the_one_that_the_program_states(suffix):
    """Far from the posture before it, which would have led to another branch."""
    done = corrected(PROGRAMS[suffix][0](), suffix, near_rad=-Q[0])
    nominal = sorted(done.found.nominal_rad.tolist())
    assert np.allclose(nominal, sorted(Q.tolist()), atol=2e-5)
