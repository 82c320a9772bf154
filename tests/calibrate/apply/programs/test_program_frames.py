"""Frames and tools of programs: what a file declares is used, what it only names the user states."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibrate.apply.correct.corrected import Options
from calibrate.apply.programs.rewriting import correct_program, dialect_of
from calibrate.errors import DataError
from calibrate.model.rigid import inverse as inverse_of
from tests.calibrate.apply.correct.six_joints import drawn, inverse, model, postures

Q = postures(1)
FLANGE = drawn().frames(Q)[0, -1]


def frame(x, y, z, a, b, c):
    """m and degrees about z, y, x of the turning frame."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_euler("ZYX", [a, b, c], degrees=True).as_matrix(), (x, y, z)
    return T


USER, OBJECT, TORCH = frame(0.4, -0.1, 0.2, 30, 5, -10), frame(0.02, 0.05, 0, 0, 90, 0), frame(0.01, 0, 0.1, 0, 40, 0)
TABLE = USER @ OBJECT


def rapid_pose(T):
    x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat()
    return f"[{','.join(f'{1e3 * v:.7f}' for v in T[:3, 3])}],[{w:.12f},{x:.12f},{y:.12f},{z:.12f}]"


def krl_pose(T):
    angles = Rotation.from_matrix(T[:3, :3]).as_euler("ZYX", degrees=True)
    values = (*(1e3 * T[:3, 3]), *angles)
    return ", ".join(f"{key} {value:.9f}" for key, value in zip("XYZABC", values, strict=True))


def fanuc_pose(T):
    angles = Rotation.from_matrix(T[:3, :3]).as_euler("ZYX", degrees=True)[::-1]
    lengths = ", ".join(f"{k} = {1e3 * v:.6f} mm" for k, v in zip("XYZ", T[:3, 3], strict=True))
    return lengths + ", " + ", ".join(f"{k} = {v:.8f} deg" for k, v in zip("WPR", angles, strict=True))


def target(within, tool):
    """What a program says for the flange at Q."""
    return inverse_of(within) @ FLANGE @ tool


CONF = ",".join(str(int(np.floor(Q[0, j] / (np.pi / 2)))) for j in (0, 3, 5))


def rapid(use="torch\\WObj:=table", declared=True, held="FALSE", fixed="TRUE", tool_held="TRUE", more=""):
    places = f"""  PERS wobjdata table := [{held},{fixed},"",[{rapid_pose(USER)}],
    [{rapid_pose(OBJECT)}]];
  PERS tooldata torch := [{tool_held}, [{rapid_pose(TORCH)}],[1,[0,0,1],[1,0,0,0],0,0,0]];
"""
    lines = rapid_pose(target(TABLE, TORCH)).replace("],[", "],\n     [")
    return f"""MODULE weld
{places if declared else ""}  CONST robtarget p10 :=
    [{lines},
     [{CONF},0],
     [9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveL p10, v50, fine, {use};
{more}  ENDPROC
ENDMODULE
"""


def corrected(text, suffix, frame=None, tool=None):
    return correct_program(
        model(), text, dialect_of(suffix), frame, Q[0], {}, inverse(), Options(tool=tool), "weld" + suffix
    )


def skipped(text, suffix, frame=None, tool=None):
    """The sentence for a program none of whose targets can be corrected."""
    with pytest.raises(DataError) as caught:
        corrected(text, suffix, frame, tool)
    return str(caught.value)


def assert_reached(done):
    """The flange that the controller is sent to is the one that the table of poses asks for with that tool."""
    assert np.allclose(done.found.nominal_rad[0], Q[0], atol=1e-6)
    assert done.found.after.error_m[0] < 2e-6
    assert done.found.before.error_m[0] > 2e-4


def test_rapid_targets_are_in_the_declared_work_object_with_the_declared_tool():
    done = corrected(rapid(), ".mod")
    assert_reached(done)
    as_stated = corrected(rapid(declared=False), ".mod", TABLE, TORCH)
    assert np.allclose(done.found.q_rad, as_stated.found.q_rad, atol=1e-9)
    assert as_stated.text.splitlines()[1:] == done.text.splitlines()[4:]  # written back in the same work object


def test_a_tool_of_the_file_is_held_against_that_of_the_user():
    assert_reached(corrected(rapid(), ".mod", tool=TORCH))
    assert "the tool torch, as the file declares it, is not the one of --tool" in skipped(rapid(), ".mod", None, USER)


def test_what_a_rapid_file_only_names_is_not_corrected_in_the_base():
    says = skipped(rapid(declared=False), ".mod")
    assert "line 3: p10: the pose of table is not in this file; declare it there, or give it with --frame" in says
    assert "the pose of torch is not in this file" in skipped(rapid(declared=False), ".mod", TABLE)
    assert "the pose of table is not in this file" in skipped(rapid(more="    table.oframe := here;\n"), ".mod")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (rapid(fixed="FALSE"), "work object table is held by a robot or moved by a unit"),
        (rapid(held="TRUE"), "work object table is held by a robot or moved by a unit"),
        (rapid(tool_held="FALSE"), "tool torch is stationary"),
        (rapid(more="    PDispSet shift;\n"), "the program displaces its targets"),
        (rapid(more="    MoveL p10, v50, fine, torch;\n"), "it is used in several frames (table, wobj0)"),
        (rapid(more="    ArcL p10, v50, seam, bead, fine, torch\\WObj:=jig;\n"), "the pose of jig is not in this file"),
    ],
)
def test_work_objects_that_move_and_targets_of_two_frames_are_refused(text, says):
    assert says in skipped(text, ".mod")


def test_a_frame_that_no_target_needs_is_refused():
    assert "leave --frame out" in skipped(rapid(), ".mod", USER)
    assert "leave --frame out" in skipped("movel(p[0.3, 0.1, 0.4, 0.0, 0.0, 0.0])\n", ".script", USER)


def test_two_tools_of_a_file_are_corrected_one_at_a_time():
    q = target(np.eye(4), np.eye(4))
    more = f"    MoveL [{rapid_pose(q)},[{CONF},0],[9E9,9E9,9E9,9E9,9E9,9E9]], v50, fine, tool0;\n"
    assert "tools tool0, torch; give one of them with --tool" in skipped(rapid(more=more), ".mod")
    done = corrected(rapid(more=more), ".mod", tool=TORCH)
    assert len(done.names) == 1
    assert "the tool tool0, as the file declares it, is not the one of --tool" in done.skipped[-1]


def test_two_tools_that_are_set_one_after_the_other_are_two():
    lines = krl("  $BASE = $NULLFRAME\n  $TOOL = {{{tool}}}\n").replace("END", "").replace("DEF weld()", "")
    other = lines.replace(krl_pose(TORCH), krl_pose(TABLE))
    assert "give one of them with --tool" in skipped(lines + other, ".src")


def test_a_quaternion_that_is_none_is_refused():
    text = f"MoveL [[300,0,400],[0,0,0,0],[{CONF},0],[9E9,9E9,9E9,9E9,9E9,9E9]], v50, fine, tool0;\n"
    assert "quaternion [0.0, 0.0, 0.0, 0.0]: its length is not 1" in skipped(text, ".mod")


def test_a_stated_frame_is_none_for_targets_that_are_refused():
    T, branch = krl_pose(target(TABLE, np.eye(4))), "  IF a THEN\n$BASE = $NULLFRAME\nENDIF\n"
    done = corrected(f"BAS(#BASE, 1)\nLIN {{{T}}}\n{branch}LIN {{{T}}}\n", ".src", TABLE)
    assert (len(done.names), len(done.skipped)) == (1, 1)


KRL_FRAMES = {
    "literal": "  $BASE = {{{base}}}\n  $TOOL = {{{tool}}}\n",
    "data": "  BASE_DATA[2] = {{{base}}}\n  TOOL_DATA[3] = {{FRAME: {tool}}}\n"
    "  BAS(#BASE, 2)\n  $TOOL = TOOL_DATA[3]\n",
    "named": "  DECL FRAME table = {{{base}}}\n  FRAME torch = {{{tool}}}\n  $BASE = table\n  $TOOL = torch\n",
    "inline form": "  BASE_DATA[2]={{{base}}}\n  TOOL_DATA[3]={{{tool}}}\n"
    "  DECL FDAT FP1={{TOOL_NO 3,BASE_NO 2,IPO_FRAME #BASE}}\n  FDAT_ACT=FP1\n",
}


def krl(frames):
    held = frames.format(base=krl_pose(TABLE), tool=krl_pose(TORCH))
    return f"DEF weld()\n{held}  LIN {{{krl_pose(target(TABLE, TORCH))}}}\nEND\n"


@pytest.mark.parametrize("frames", KRL_FRAMES.values(), ids=KRL_FRAMES)
def test_krl_targets_are_in_the_base_that_was_set_last(frames):
    assert_reached(corrected(krl("  $BASE = $NULLFRAME\n" + frames), ".src"))


def test_points_of_inline_forms_have_the_frames_of_their_fdat():
    frames = KRL_FRAMES["inline form"].replace("  FDAT_ACT=FP1\n", "")
    point = f"  DECL E6POS XP1={{{krl_pose(target(TABLE, TORCH))},\n S 2,T 2}}\n".replace(",\n S 2,T 2", "")
    held = frames.format(base=krl_pose(TABLE), tool=krl_pose(TORCH))
    assert_reached(corrected(f"DEFDAT WELD\n{held}{point}ENDDAT\n", ".dat"))


@pytest.mark.parametrize(
    ("frames", "says"),
    [
        ("", "the file sets no frame before it; give it with --frame"),
        ("  BAS(#BASE, 2)\n", "the pose of BASE_DATA[2] is not in this file"),
        ("  FDAT_ACT=FP1\n", "the pose of FDAT FP1 is not in this file"),
        ("  $BASE = $NULLFRAME\n  $TOOL = TOOL_DATA[3]\n", "the pose of TOOL_DATA[3] is not in this file"),
        ("  $BASE = $NULLFRAME\n  $BASE.X = 100.0\n", "line 3 sets only a component of $BASE, which is not followed"),
        ("  $BASE = $NULLFRAME\n  $IPO_MODE = #TCP\n", "the tool is stationary"),
        ("  $BASE = $NULLFRAME\nEND\nDEF below()\n", "the file sets no frame before it"),
    ],
)
def test_krl_targets_whose_frame_is_not_in_the_file_are_left_alone(frames, says):
    assert says in skipped(krl(frames), ".src")


def fanuc(uf, ut, T):
    position = f"P[1]{{\n GP1:\n UF : {uf}, UT : {ut},\n {fanuc_pose(T)}\n}};\n"
    return f"/PROG W\n/MN\n 1:L P[1] 50mm/sec FINE ;\n/POS\n{position}/END\n"


def test_fanuc_frames_other_than_zero_are_stated_by_the_user():
    assert_reached(corrected(fanuc(0, 0, target(np.eye(4), np.eye(4))), ".ls"))
    assert_reached(corrected(fanuc(3, 1, target(TABLE, TORCH)), ".ls", TABLE, TORCH))
    assert "P[1]: the pose of UF 3 is not in this file" in skipped(fanuc(3, 0, FLANGE), ".ls")
    assert "P[1]: the pose of UT 1 is not in this file" in skipped(fanuc(0, 1, FLANGE), ".ls")
    assert "leave --frame out" in skipped(fanuc(0, 0, FLANGE), ".ls", TABLE)
    two = fanuc(3, 0, FLANGE).replace("/END", fanuc(4, 0, FLANGE).split("/POS\n")[1].replace("P[1]", "P[2]"))
    assert "UF 3, UF 4, which the file does not hold" in skipped(two, ".ls", TABLE)


@pytest.mark.parametrize(
    ("text", "suffix", "base", "tool"),
    [
        (rapid(), ".mod", "table", "torch"),
        (krl(KRL_FRAMES["literal"]), ".src", "base as set in line 2", "$TOOL of line 3"),
        (krl(KRL_FRAMES["data"]), ".src", "BASE_DATA[2]", "TOOL_DATA[3]"),
        (fanuc(3, 1, target(TABLE, TORCH)), ".ls", "UF 3", "UT 1"),
    ],
)
def test_what_has_to_be_measured_again_is_named_as_the_program_has_it(text, suffix, base, tool):
    done = corrected(text, suffix, *((TABLE, TORCH) if suffix == ".ls" else ()))
    (frame,) = done.found.of_frames(done.frames, done.frame_names)
    assert frame.name == base
    assert any(f"tool {tool}" in note and "teach it again" in note for note in done.found.notes)


def test_each_frame_has_its_own_error():
    """Of one pose a frame takes up the whole error that it was taught with; joint targets are in no frame."""
    more = f"    MoveJ [{rapid_pose(FLANGE @ TORCH)},[{CONF},0],[9E9,9E9,9E9,9E9,9E9,9E9]], v50, fine, torch;\n"
    joints = f"    MoveAbsJ [[{','.join(map(str, np.degrees(Q[0])))}],[9E9,9E9,9E9,9E9,9E9,9E9]], v50, fine, torch;\n"
    done = correct_program(
        model(),
        rapid(more=more + joints),
        dialect_of(".mod"),
        None,
        Q[0],
        {},
        inverse(),
        Options(joint_targets=True),
        "weld.mod",
    )
    table, own = done.found.of_frames(done.frames, done.frame_names)
    assert (table.name, "own base (wobj0)" in own.name, len(done.names)) == ("table", True, 3)
    before_m = done.found.before.error_m[0]
    assert table.as_it_is_m == pytest.approx(np.hypot(table.again_m, before_m), rel=1e-3)
    assert own.again_m == pytest.approx(done.found.after.rms_m, rel=0.1)


def test_urscript_poses_have_the_tool_that_was_set_last():
    T = target(np.eye(4), TORCH)
    listed = [
        ", ".join(f"{v:.9f}" for v in (*p[:3, 3], *Rotation.from_matrix(p[:3, :3]).as_rotvec())) for p in (TORCH, T)
    ]
    assert_reached(corrected("set_tcp(p[{}])\nmovel(p[{}], a=1.2)\n".format(*listed), ".script"))
    assert "set_tcp of line 1 is not in this file" in skipped(
        "set_tcp(tip)\nmovel(p[{1}])\n".format(*listed), ".script"
    )


def angles_at(**degrees):
    q = np.radians([20.0, 10.0, -15.0, 40.0, 50.0, 30.0])
    for joint, value in degrees.items():
        q[int(joint[1]) - 1] = np.radians(value)
    return q


@pytest.mark.parametrize(
    ("edge", "cf"),
    [
        ({"j1": 0.0}, "0,0,0"),
        ({"j1": 0.0}, "-1,0,0"),
        ({"j4": 90.0}, "0,0,0"),
        ({"j4": 90.0}, "0,1,0"),
        ({"j6": -90.0}, "0,0,-1"),
        ({"j6": -180.0}, "0,0,-2"),
        ({"j6": 180.0}, "0,0,1"),
    ],
)
def test_an_axis_at_the_edge_of_a_quarter_turn_keeps_its_posture(edge, cf):
    q = angles_at(**edge)
    T = drawn().frames(q[None])[0, -1]
    text = f"MoveL [{rapid_pose(T)},[{cf},0],[9E9,9E9,9E9,9E9,9E9,9E9]], v50, fine, tool0;\n"
    done = corrected(text, ".mod")
    assert np.allclose(done.found.nominal_rad[0], q, atol=1e-6)


def test_the_turn_is_the_one_that_the_program_states():
    """The last axis may turn by more than once: 200 degrees is far from the posture before, and not -160 degrees."""
    q = angles_at(j6=200.0)
    T = drawn().frames(q[None])[0, -1]
    text = f"MoveL [{rapid_pose(T)},[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]], v50, fine, tool0;\n"
    assert np.allclose(corrected(text, ".mod").found.nominal_rad[0], q, atol=1e-6)


def test_configurations_follow_an_axis_that_the_correction_takes_over_an_edge():
    """0.055 degrees before 0 the correction by more than a tenth ends on the other side, in the same posture."""
    q = angles_at(j6=0.055)
    T = drawn().frames(q[None])[0, -1]
    text = f"MoveL [{rapid_pose(T)},[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]], v50, fine, tool0;\n"
    assert "[0,0,-1,0]" in corrected(text, ".mod").text
    line = f"$BASE=$NULLFRAME\nLIN {{{krl_pose(T)}, S 2, T 'B000100'}}\n"
    assert f"T {0b100100}}}" in corrected(line, ".src", tool=np.eye(4)).text
