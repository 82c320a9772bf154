"""Forms of motion in RAPID as taught programs, RobotStudio, plug-ins of CAD and generators write them."""

import pytest

from calibrate.errors import DataError
from tests.calibrate.apply.programs.forms import OWN, TABLE, Form, abb, assert_form, corrected, rapid_pose

E9 = ",".join(["9E+09"] * 6)
E10 = ",".join(["1E+10"] * 6)
TOOL = f"PERS tooldata gun:=[TRUE,[{rapid_pose(OWN)}],[1,[0,0,1],[1,0,0,0],0,0,0]];\n"
PLACE = f'TASK PERS wobjdata jig:=[FALSE,TRUE,"",[{rapid_pose(TABLE)}],[[0,0,0],[1,0,0,0]]];\n'
HEAD = TOOL + PLACE  # two lines
DUMMY = "0,0,0,0"
OTHER = "3,-3,3,0"  # a configuration in which the arm does not stand
ZERO = "0,9E9,9E9,9E9,9E9,9E9"
STATION = '[FALSE,FALSE,"STN1",[[0,0,0],[1,0,0,0]],[[0,0,233],[1,0,0,0]]]'


def declared(*targets: str) -> str:
    return "".join(f"CONST robtarget Target_{k}0:={t};\n" for k, t in enumerate(targets, start=1))


def move(target: str, word: str = "MoveL", tool: str = "gun") -> str:
    return f"{word} {target},v200,fine,{tool};\n"


def main(body: str, more: str = "") -> str:
    return f"PROC main()\n{body}ENDPROC\n{more}"


FORMS = (
    Form(
        "RobotStudio path, work object of the station",
        HEAD
        + declared(abb(0, E9, frame=TABLE), abb(1, E9, frame=TABLE))
        + main("MoveJ Target_10,v1000,z100,gun\\WObj:=jig;\nMoveL Target_20,v1000,fine,gun\\WObj:=jig;\n"),
        (0, 1),
        near=True,
    ),
    Form(
        "taught points, home by joints",
        HEAD
        + declared(abb(0, "9E+9,9E+9,9E+9,9E+9,9E+9,9E+9"))
        + "CONST jointtarget Zero:=[[0,0,0,0,30,0],[9E+9,9E+9,9E+9,9E+9,9E+9,9E+9]];\n"
        + main("MoveAbsJ Zero\\NoEOffs, v1000, z50, tool0;\nMoveL Target_10, v1000, z50, tool0;\n"),
        (0,),
        kept=1,
        near=True,
    ),
    Form(
        "Machina: unused axes as 1E+10",
        HEAD + declared(abb(0, E10)) + main(move("Target_10")),
        (0,),
    ),
    Form(
        "TACO for Grasshopper: ConfL and ConfJ off, unused track at zero",
        HEAD + main(f"ConfL \\Off;\nConfJ \\Off;\n{move(abb(0, ZERO, OTHER), 'MoveJ')}{move(abb(1, ZERO, OTHER))}"),
        (0, 1),
    ),
    Form(
        "generator of a wall: ConfL off, no configuration stated",
        HEAD + main(f"!Motion configuration\nConfL\\Off;\n\n{move(abb(0, E9, OTHER))}{move(abb(1, E9, OTHER))}"),
        (0, 1),
    ),
    Form(
        "laser path, PowerMill: configurations of linear moves only are ignored",
        HEAD + main(f"ConfJ\\On;\nConfL\\Off;\n{move(abb(0), 'MoveJ')}{move(abb(1, conf=OTHER))}"),
        (0, 1),
    ),
    Form(
        "drawing: ConfL off in the calling routine",
        HEAD + main("ConfL\\Off;\nPart1;\nConfL\\On;\n", f"PROC Part1()\n{move(abb(2, conf=OTHER))}ENDPROC\n"),
        (2,),
    ),
    Form(
        "cell with welding: ConfL off where a signal is set",
        HEAD + main(f"IF di1=1 THEN\nConfL\\Off;\nENDIF\n{move(abb(0))}ConfL\\On;\n{move(abb(1))}"),
        (1,),
        {7: "ConfL"},
    ),
    Form(
        "ConfL off for one instruction of an IF",
        HEAD + main(f"IF di1=1 ConfL\\Off;\n{move(abb(0))}{move(abb(1), 'MoveJ')}"),
        (1,),
        {5: "ConfL"},
    ),
    Form(
        "Robots for Grasshopper: identity of a move in a synchronized group",
        HEAD + main(f"MoveJ {abb(0)}\\ID:=1,Speed000,fine,gun \\WObj:=wobj0;\n"),
        (0,),
    ),
    Form(
        "MultiMove with a positioner: work object of a unit",
        HEAD
        + f"TASK PERS wobjdata Frame000:={STATION};\n"
        + main(f"ActUnit STN1;\n{move(abb(0), tool='gun' + chr(92) + 'WObj:=Frame000')}{move(abb(1))}"),
        (1,),
        {6: "moved by a unit"},
    ),
    Form(
        "arc welding with weaving and tracking",
        HEAD
        + declared(abb(0), abb(1))
        + main(
            'ArcLStart Target_10,v100,sm1,wd1\\Weave:=wv1,fine,gun\\WObj:=wobj0\\Track:=tr1\\SeamName:="S1";\n'
            "ArcLEnd Target_20,v100,sm1,wd1\\Weave:=wv1,fine,gun\\WObj:=wobj0\\Track:=tr1;\n"
        ),
        (0, 1),
    ),
    Form(
        "surgery at a distance: time of a move behind a comma",
        HEAD + declared(abb(0)) + main("MoveL Target_10, v100, \\T:=t1, z5, gun;\n"),
        (0,),
    ),
    Form(
        "measuring cell: axes of a computed target that are not there",
        HEAD + declared(abb(0)) + "pNew.extax:=[9e9,9e9,9e9,9e9,9e9,9e9];\n" + main(move("Target_10")),
        (0,),
    ),
    Form(
        "gluing: output at the end of a move",
        HEAD + declared(abb(0)) + main("MoveLDO Target_10,v100,fine,gun,doClamp,1;\n"),
        (0,),
    ),
    Form(
        "palletizing: offsets of a taught point",
        HEAD + declared(abb(0)) + main(f"{move('Offs(Target_10,0,0,50)')}{move('Target_10')}"),
        (0,),
        {5: "no literal"},
    ),
    Form(
        "search for a part",
        HEAD
        + declared(abb(0), abb(1))
        + main(f"{move('Target_10')}SearchL\\Stop,diPart,pFound,Target_20,v50,gun\\WObj:=wobj0;\n"),
        (0,),
        {4: "sets no frame", 7: "the form of this move is not known"},
    ),
    Form(
        "3D printing: process move of a module of its own",
        HEAD + main(f"{move(abb(0))}WArcLStart {abb(1)},v100,sm1,bead1,fine,nozzle;\n"),
        (0,),
        {5: "no move of this file"},
    ),
    Form(
        "circle by two targets, Conc",
        HEAD + main(f"{move(abb(0))}MoveC {abb(1)},{abb(2)},v50,fine,gun;\nMoveL \\Conc, {abb(3)},v50,fine,gun;\n"),
        (0, 1, 2, 3),
    ),
)


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.source)
def test_the_real_arm_reaches_the_targets_of_rapid_forms_and_the_rest_is_listed(form: Form) -> None:
    assert_form(form, ".mod")


BESIDE = {  # text, reason in the error
    "IRB 4600 on a track, COMPAS RRC": (
        move(abb(0, "3399.99,9E9,9E9,9E9,9E9,9E9")) + move(abb(1, "3079.80,9E9,9E9,9E9,9E9,9E9")),
        "line 1: external axis eax_a is at 3399.99: where it carries the arm or the part is not known",
    ),
    "YuMi with its seventh axis": (
        declared(abb(0, "-101.614,9E+9,9E+9,9E+9,9E+9,9E+9")) + move("Target_10"),
        "line 1: Target_10: external axis eax_a is at -101.614",
    ),
    "home of a gantry": (
        "MoveAbsJ [[0,0,0,0,30,0],[12000,470.018,767.656,9E9,9E9,12000]],v50,fine,gun;\n" + move(abb(0)),
        "external axis eax_a is at 12000 for other targets, and this one does not state it",
    ),
    "plotter beside a bed on a track: axis that the program computes": (
        declared(abb(0, ZERO)) + "Target_10.extax.eax_a:=nBed+50;\n" + move("Target_10"),
        "Target_10: external axis eax_a moves: it is at 0 here, and computed for other targets",
    ),
    "displaced": (
        f"PDispSet shift1;\n{move(abb(0))}{move(abb(1))}",
        "line 2: the program displaces its targets (PDispSet, PDispOn); not corrected; and 1 more",
    ),
    "a move of another module": (
        "MoveHome;\nMoveJ pOther,v50,fine,tool0;\n",
        "1 motion instructions are in it, first in line 2: MoveJ pOther,v50,fine,tool0;",
    ),
}


@pytest.mark.parametrize(("text", "reason"), BESIDE.values(), ids=BESIDE)
def test_rapid_targets_that_cannot_be_corrected_are_left_with_their_reason(text: str, reason: str) -> None:
    with pytest.raises(DataError) as caught:
        corrected(TOOL.replace("\n", "") + text, ".mod")
    assert reason in str(caught.value)


def test_a_configuration_that_is_observed_again_selects_the_posture() -> None:
    text = HEAD + main(f"ConfL\\Off;\n{move(abb(0, conf=OTHER))}ConfL\\On;\n{move(abb(1, conf=OTHER))}")
    assert list(corrected(text, ".mod").found.status)[1] == "unreachable"
