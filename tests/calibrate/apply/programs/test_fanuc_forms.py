"""Forms of motion in listings of FANUC as controllers and generators write them."""

import pytest

from calibrate.errors import DataError
from tests.calibrate.apply.programs.forms import TABLE, Form, assert_form, corrected, fanuc

HEAD = "/PROG  WELD\n/ATTR\nOWNER\t\t= MNEDITOR;\nDEFAULT_GROUP\t= 1,*,*,*,*;\n/MN\n"  # five lines
TRACK = ",\n\tE1= {}  mm"
POSITIONER = "\n   GP2:\n\tUF : 0, UT : 0,\t\n\tJ1=     {} deg"


def program(moves: str, *bodies: str, frame: int = 0) -> str:
    positions = "".join(
        f"P[{k}]{{\n   GP1:\n\tUF : {frame}, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n\t{body}\n}};\n"
        for k, body in enumerate(bodies, start=1)
    )
    return f"{HEAD}{moves}/POS\n{positions}/END\n"


FORMS = (
    Form(
        "hand-eye calibration, taught",
        program(
            "   4:  UTOOL_NUM=1 ;\n   5:  UFRAME_NUM=0 ;\n   6:   ;\n   7:J P[1] 100% FINE    ;\n"
            "   8:L P[2] 100mm/sec CNT100 ACC10    ;\n",
            fanuc(0),
            fanuc(1),
        ),
        (0, 1),
    ),
    Form(
        "hand-eye calibration with a positioner in a group of its own",
        program(
            "   1:L P[1] 100mm/sec CNT100    ;\n   2:L P[2] 100mm/sec CNT100    ;\n",
            fanuc(0) + POSITIONER.format("6.425"),
            fanuc(1) + POSITIONER.format("8.241"),
        ),
        (0, 1),
    ),
    Form(
        "car body line: actions before the end of a move, with lines of their own",
        program(
            "   5:J P[1] 100% CNT0 ACC100 TB    .10sec,P-SPS    ;\n      1:  TC_ONLINE (ON) ;\n"
            "      2:  DO[23]=(OFF) ;\n       ------ ;\n   6:L P[2] 2000mm/sec CNT70 TB   0.00sec,DO[115]=ON    ;\n",
            fanuc(0),
            fanuc(1),
        ),
        (0, 1),
    ),
    Form(
        "printed layers: blanks behind the numbers, lines without numbers",
        program(
            ":SR[30]=60.0;\n1: L P[1] 240cm/min CNT100 ;\n: Arc Start[1];\n2: L P[2] WELD_SPEED CNT100 PTH ;\n",
            fanuc(0),
            fanuc(1),
        ),
        (0, 1),
    ),
    Form(
        "printed layers: coordinated with a positioner",
        program(
            "1: L P[1] 240cm/min CNT100 ;\n: Weave Sine[5];\n2: L P[2] WELD_SPEED CNT100 COORD PTH ;\n",
            fanuc(0),
            fanuc(1),
        ),
        (0,),
        {8: "with COORD"},
    ),
    Form(
        "gripping: the same position with and without an offset of the tool",
        program(
            "  13:J P[1] 100% CNT20 Tool_Offset,PR[6:offset]    ;\n  14:L P[1] R[25:speed L]mm/sec FINE    ;\n"
            "  15:  CALL GRIP(3) ;\n  16:L P[2:over] 500mm/sec CNT50 Offset,PR[90]    ;\n",
            fanuc(0),
            fanuc(1),
        ),
        (0,),
        {6: "with Tool_Offset", 9: "with Offset"},
    ),
    Form(
        "tool changer: position registers with names",
        program("  50:L PR[174:Pounce] 1000mm/sec CNT25    ;\n  51:L P[1] 400mm/sec FINE ;\n", fanuc(0)),
        (0,),
        {6: "position registers"},
    ),
    Form(
        "line that is taken out, position chosen by a register",
        program(
            "  84:  //J P[9] 100% FINE    ;\n  85:J P[1] 100% CNT100    ;\n  86:L P[R[5]] 100mm/sec FINE ;\n", fanuc(0)
        ),
        (0,),
        {8: "chosen while the program runs"},
    ),
    Form(
        "car body line, controller in German",
        program(
            "  13:  TRAGLST[2] ;\n  14:J P[1] 100% CNT100 ACC100 ZEIT VOR   0.00sek,P-SPS    ;\n"
            "      1:  FB-PSPS (E[41] [&] M[30]) ;\n       ------ ;\n  15:L P[2] 2000mm/sek CNT0 ACC100    ;\n",
            fanuc(0),
            fanuc(1),
        ).replace("CONFIG : 'N U T", "KONFIG : 'N D B"),
        (0, 1),
    ),
    Form(
        "car body line, controller in German: offset of the tool, jump on a signal",
        program(
            "   9:J P[1] 100% CNT0 ACC100 WKZ_Offset ,PR[2]    ;\n"
            "  10:L P[2] 10mm/sek CNT0 ACC250 Interrupt,LABEL[1]    ;\n"
            "  11:L P[3] 50mm/sec CNT0 ACC100 Skip,LBL[1],PR[5]=LPOS ;\n",
            *(fanuc(i) for i in range(3)),
        ),
        (1, 2),
        {6: "with WKZ_Offset"},
    ),
    Form(
        "offset whose word is not known: its register shows it",
        program("   9:J P[1] 100% CNT0 Verschub,PR[2]    ;\n  10:L P[2] 10mm/sek CNT0 ;\n", fanuc(0), fanuc(1)),
        (1,),
        {6: "with PR"},
    ),
    Form(
        "TP+ compiler: lines without numbers, positions with names, one that was never taught",
        program(
            " : J P[1:home] 10% FINE ;\n : L P[2:weld] 100mm/sec FINE ;\n : L P[3] 9mm/sec FINE ;\n",
            fanuc(0),
            fanuc(1),
            "X = ********  mm,\tY = ********  mm,\tZ = ********  mm,\n\tW = ******** deg,\tP = ******** deg",
        ).replace("P[2]{", 'P[2:"Weld"]{'),
        (0, 1),
        {22: "not a whole position"},
    ),
    Form(
        "arc: the end in a line of its own, user frame",
        program(
            "   1:L P[1] 50mm/sec FINE    ;\n   2:C P[2]    \n    :  P[3] 50mm/sec FINE    ;\n",
            *(fanuc(i, TABLE) for i in range(3)),
            frame=4,
        ),
        (0, 1, 2),
        frame=TABLE,
    ),
    Form(
        "cell with a track that stands at zero",
        program("   5:L P[1] 100mm/sec FINE ACC10    ;\n", fanuc(0) + TRACK.format("0.000")),
        (0,),
    ),
)


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.source)
def test_the_real_arm_reaches_the_targets_of_fanuc_forms_and_the_rest_is_listed(form: Form) -> None:
    assert_form(form, ".ls")


BESIDE = {
    "tool changer of a cell with a track": (
        program("   5:L P[1] 100mm/sec FINE ;\n", fanuc(0) + TRACK.format("-1290.488")),
        "P[1]: external axis E1 is at -1290.49: where it carries the arm or the part is not known",
    ),
    "track that one position does not state": (
        program(
            "   5:L P[1] 9mm/sec FINE ;\n   6:L P[2] 9mm/sec FINE ;\n", fanuc(0), fanuc(1) + TRACK.format("50.000")
        ),
        "P[1]: external axis E1 is at 50 for other targets, and this one does not state it",
    ),
    "moves to registers only": (
        program("   1:J PR[1:HOME] 100% FINE    ;\n   2:L PR[2] 100mm/sec FINE    ;\n"),
        "2 motion instructions are in it, first in line 6: 1:J PR[1:HOME] 100% FINE ;",
    ),
}


@pytest.mark.parametrize(("text", "reason"), BESIDE.values(), ids=BESIDE)
def test_fanuc_targets_that_cannot_be_corrected_are_left_with_their_reason(text: str, reason: str) -> None:
    with pytest.raises(DataError) as caught:
        corrected(text, ".ls")
    assert reason in str(caught.value)
