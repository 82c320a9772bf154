"""Forms of motion in URScript as PolyScope, post-processors and generators write them."""

import numpy as np
import pytest

from calibrate.errors import DataError
from tests.calibrate.apply.programs.forms import OWN, TABLE, Form, Q, assert_form, corrected, ur, ur_joints, ur_pose

FAST = "a=1.3962634015954636, v=1.0471975511965976"
SLOW = "a=1.2, v=0.25"


def waypoint(k: int, i: int, frame: np.ndarray = OWN) -> str:
    return f"  global Waypoint_{k}_p={ur(i, frame)}\n  global Waypoint_{k}_q={ur_joints(i)}\n"


def solved(k: int) -> str:
    return f"  movej(get_inverse_kin(Waypoint_{k}_p, qnear=Waypoint_{k}_q), {FAST})\n"


PLANE = f"  global Plane_1={ur_pose(TABLE)}\n"
OTHER = "p[0.1, 0.0, 0.0, 0.0, 0.0, 0.3]"

FORMS = (
    Form(
        "PolyScope 5 program: MoveJ and MoveL to waypoints",
        f'def weld():\n{waypoint(1, 3)}{waypoint(2, 1)}{waypoint(3, 5)}  $ 3 "Waypoint_1" "breakAfter"\n{solved(1)}'
        f"{solved(3)}{solved(2)}  movel(Waypoint_2_p, {SLOW})\nend\n",
        (3, 1, 5),
        near=True,
    ),
    Form(
        "URCap of a panel cell: pose and posture in the move",
        f"movej(get_inverse_kin({ur(5)}, qnear={ur_joints(5)}), a=8.726646, v=4.363323)\n"
        f"movej(get_inverse_kin({ur(2)}, {ur_joints(2)}), {FAST})\n",
        (5, 2),
        near=True,
    ),
    Form(
        "pick and place by hand: get_inverse_kin without a posture, in movej and movel",
        f"p1  = {ur(0)}\np2  = {ur(1)}\nmovej(get_inverse_kin(p1))\nmovel(get_inverse_kin(p2))\n",
        (0, 1),
    ),
    Form(
        "PolyScope 5 program: home by joints before a waypoint",
        f"def weld():\n{waypoint(1, 5)}  movej({ur_joints(0)}, {FAST})\n  movej(get_inverse_kin({ur(5)}, "
        f"qnear={ur_joints(5)}), {FAST})\n{solved(1)}end\n",
        (5, 5),
        kept=1,
        near=True,
    ),
    Form(
        "camera cell: posture of the moment",
        f"movej(get_inverse_kin({ur(0)}, qnear=get_actual_joint_positions()), a=1.2, v=0.8)\n",
        (0,),
    ),
    Form(
        "viam: get_inverse_kin of a pose, blend radius",
        f"movej(get_inverse_kin({ur(0)}), a=1.4, v=4, r=0)\n",
        (0,),
    ),
    Form(
        "Czech path generator: movel within a plane feature",
        f"def path():\n{PLANE}  movel(pose_trans(Plane_1, {ur(0, TABLE)}), a=1.0, v=0.05)\n"
        f"  movel(pose_trans(Plane_1,{ur(1, TABLE)}), a=1.0, v=0.05)\nend\n",
        (0, 1),
    ),
    Form(
        "PolyScope 5 program: waypoints within a plane feature",
        f"def weld():\n{PLANE}{waypoint(1, 0, TABLE)}{waypoint(2, 1)}"
        f"  movel(pose_trans(Plane_1, Waypoint_1_p), {SLOW})\n{solved(2)}end\n",
        (0, 1),
    ),
    Form(
        "plotter: movej of a pose within a feature",
        f"f_name = {ur_pose(TABLE)}\nmovej(get_inverse_kin(pose_trans(f_name,{ur(0, TABLE)})), a=accel, v=vel, t=0)\n",
        (0,),
    ),
    Form(
        "RoboDK post for UR: the reference is set again",
        f"def Main():\n  ref_frame = {ur_pose(TABLE)}\n"
        f"  movel(pose_trans(ref_frame,{ur(0, TABLE)}),accel_mss,speed_ms,0,blend_radius_m)\n"
        f"  ref_frame = {ur_pose(OWN)}\n  movel(pose_trans(ref_frame,{ur(1)}),accel_mss,speed_ms,0,0.000)\nend\n",
        (0, 1),
    ),
    Form(
        "3D printing: movep within a feature that a branch sets",
        f"feature1 = {ur_pose(TABLE)}\nmovep(pose_trans(feature1, {ur(0, TABLE)}), a=acc, v=speed_g0, r=0)\n"
        f"if large:\nfeature1 = {OTHER}\nend\nmovep(pose_trans(feature1, {ur(1)}), a=acc, v=speed_g0, r=0)\n",
        (0,),
        {6: "is set in a branch"},
    ),
    Form(
        "Autodesk post for UR: frame of the installation",
        f"movel({ur(0)},a=acc,v=0.1,r=rad_smooth)\nmovel(pose_trans(Ref_frame,{ur(1)}),a=acc,v=0.1,r=rad_smooth)\n",
        (0,),
        {2: "the pose of Ref_frame is not in this file"},
    ),
    Form(
        "approach in the tool frame of a waypoint",
        f"{waypoint(1, 0)}  movel(pose_trans(Waypoint_1_p, p[0, 0, -0.05, 0, 0, 0]), {SLOW})\n"
        f"  movel(Waypoint_1_p, {SLOW})\n",
        (0,),
        {3: "Waypoint_1_p of pose_trans is a target of another move"},
    ),
    Form(
        "frame that is computed",
        f"movel({ur(0)})\nframe = pose_add({OTHER}, {OTHER})\nmovel(pose_trans(frame, {ur(1)}))\n",
        (0,),
        {2: "no move of this file", 3: "frame of pose_trans is computed in line 2"},
    ),
    Form(
        "servo motion relative to the tool",
        f"movel({ur(0)}, {SLOW})\n"
        "servoj(get_inverse_kin(pose_trans(get_forward_kin(),p[0, 0, 0.01, 0, 0, 0])), 0.1, 0.1, 0.008, 0.1, 300)\n",
        (0,),
        {2: "no literal"},
    ),
    Form(
        "orientation by a second literal",
        f"movel({ur(0)})\nmovej(get_inverse_kin(pose_trans({ur(1)}, p[0, 0, 0, 0, 0, 1.57]), qnear={ur_joints(1)}))\n",
        (0,),
        {2: "no literal"},
    ),
    Form(
        "waypoint with changed components",
        f"{waypoint(1, 0)}  target = {ur(1)}\n  target[3] = 0.5\n  movej(get_inverse_kin(target), {FAST})\n{solved(1)}",
        (0, 1),
        {4: "changes a target"},
    ),
    Form(
        "URScript 5.19: optimized moves",
        f"movel({ur(0)})\noptimovej({ur_joints(1)}, a=0.4, v=0.5)\n",
        (0,),
        {2: "the form of this move is not known"},
    ),
    Form(
        "script manual: get_inverse_kin with another tool",
        f"movel({ur(0)})\nmovej(get_inverse_kin({ur(1)}, tcp=p[0, 0, 0.1, 0, 0, 0]))\n",
        (0,),
        {2: "a tool of its own"},
    ),
    Form(
        "CB3 program: joint waypoints and a linear move to joints",
        f"movej({ur_joints(1)}, {FAST})\nmovel({ur_joints(2)}, {SLOW})\nmovel({ur(0)}, {SLOW})\n",
        (0,),
        kept=2,
    ),
)


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.source)
def test_the_real_arm_reaches_the_targets_of_urscript_forms_and_the_rest_is_listed(form: Form) -> None:
    assert_form(form, ".script")


def test_a_posture_that_two_moves_ask_for_differently_is_the_nearest_to_the_one_before() -> None:
    text = waypoint(1, 5) + solved(1) + solved(1).replace("Waypoint_1_q", ur_joints(2))
    (found,) = corrected(text, ".script").found.nominal_rad
    (alone,) = corrected(f"movel({ur(5)})\n", ".script").found.nominal_rad
    assert np.allclose(found, alone, atol=1e-6)
    assert not np.allclose(found, Q[5], atol=0.1)


def test_a_script_whose_motion_is_computed_is_described() -> None:
    with pytest.raises(DataError) as caught:
        corrected("def a():\n  # movel(x)\n  movel(over(2), a=1)\n  movej(q)\nend\n", ".script")
    assert "2 motion instructions are in it, first in line 3: movel(over(2), a=1)" in str(caught.value)
