"""Forms of motion in KRL as taught programs, post-processors and generators write them."""

from pathlib import Path

import numpy as np
import pytest

from calibeam.cli import run
from calibrate.errors import DataError
from calibrate.model.model_file import write_model
from tests.calibrate.apply.correct.six_joints import model
from tests.calibrate.apply.programs.forms import TABLE, Form, Q, assert_form, corrected, frame_of, kuka, turns

POINTS = "".join(
    f"DECL E6POS XP{i}={{{kuka(i, TABLE, turns(i))},E1 0.0,E2 0.0}}\n"
    f'DECL FDAT FP{i}={{TOOL_NO 1,BASE_NO 2,IPO_FRAME #BASE,POINT2[] " "}}\n'
    for i in range(3)
)
WITH = (
    "$TOOL= STOOL2( FP{0}), $BASE= SBASE( FP{0}.BASE_NO),$IPO_MODE=SIPO_MODE( FP{0}.IPO_FRAME), "
    "$LOAD=SLOAD( FP{0}.TOOL_NO)"
)
AXES = "SPTP XP{0} WITH $VEL_AXIS[1]= SVEL_JOINT( 100.0), " + WITH + ", $ACC_AXIS[1]=SACC_JOINT( PPDAT1)\n"
LINE = "SLIN XP{0} WITH $VEL=SVEL_CP( 0.5, , LCPDAT1), " + WITH + ", $APO=SAPO( LCPDAT1) C_Spl\n"
ROUND = "SCIRC XP{0}, XP{1} WITH $VEL = SVEL_CP(2.0, , LCPDAT2), $TOOL = STOOL2(FP{1}), $BASE = SBASE(FP{1}.BASE_NO)\n"
DATA = f"BASE_DATA[2]={{{frame_of(TABLE)}}}\nTOOL_DATA[1]={{X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}}\n"
HOME = AXES.format("HOME").replace("FPHOME", "FHOME").replace("XPHOME", "XHOME")
COUPLED = "$BASE=EK(K_ROOT(FP{0}.BASE_NO),K_TYPE(FP{0}.BASE_NO),K_OFFS(FP{0}.BASE_NO))"
MACHINE = (
    "$BASE = EK(MACHINE_DEF[2].ROOT, MACHINE_DEF[2].MECH_TYPE, {X 0, Y 0, Z 100, A 0, B 0, C 0})\n$ACT_EX_AX = 2\n"
)
ZERO = ",E1 0.00000"
ARM = "A1 10.0,A2 -90.0,A3 90.0,A4 0.0,A5 10.0,A6 0.0"

FORMS = (
    Form("KSS 8.3 inline forms, taught", DATA + POINTS + AXES.format(0) + LINE.format(1), (0, 1, 2), near=True),
    Form("KSS 8.5 inline forms, data in $config.dat", POINTS + AXES.format(0) + LINE.format(1), (0, 1, 2), frame=TABLE),
    Form("KSS 8.5 inline form of a circle", DATA + POINTS + AXES.format(0) + ROUND.format(1, 2), (0, 1, 2)),
    Form("KSS 8.6 home position in $config.dat", DATA + POINTS + HOME + AXES.format(0), (0, 1, 2), {9: "no literal"}),
    Form(
        "generator of seams, D3DSlic3r: points as FRAME",
        DATA
        + POINTS.replace(turns(1), "").replace("E6POS XP1", "FRAME XP1").replace(",E1 0.0,E2 0.0", "")
        + AXES.format(0)
        + LINE.format(1),
        (0, 1, 2),
    ),
    Form(
        "web tool for ArcTech: base of a seam on a positioner (EK, K_ROOT)",
        DATA + POINTS + AXES.format(0) + LINE.format(1).replace("$BASE= SBASE( FP1.BASE_NO)", COUPLED.format(1)),
        (0, 2),
        {5: "carried by external axes"},
    ),
    Form(
        "Robots for Grasshopper: base on a mechanism (EK, MACHINE_DEF)",
        f"$BASE = $NULLFRAME\nLIN {{{kuka(0)}}}\n{MACHINE}LIN {{{kuka(1)}}} C_DIS\n",
        (0,),
        {5: "carried by external axes"},
    ),
    Form(
        "KSS 8.3 classic inline forms (FDAT_ACT, BAS)",
        f"{DATA}{POINTS}$BWDSTART=FALSE\nPDAT_ACT=PPDAT1\nFDAT_ACT=FP1\nBAS(#PTP_PARAMS,100)\nPTP XP1 \n"
        "LDAT_ACT=LCPDAT1\nFDAT_ACT=FP2\nBAS(#CP_PARAMS,0.5)\nLIN XP2 C_DIS C_DIS\n",
        (0, 1, 2),
    ),
    Form(
        "RoboDK post for KUKA, axis at zero",
        f"; PTP $AXIS_ACT\nPTP $AXIS_ACT\n$BASE = {{FRAME: {frame_of(TABLE)}}}\nPTP {{{ARM}{ZERO}}}\n"
        f"LIN {{{kuka(0, TABLE, ZERO)}}}\nLIN {{{kuka(1, TABLE, ZERO)}}} C_DIS\n",
        (0, 1),
        kept=1,
    ),
    Form(
        "writer of KRL in Python: PTP and CIRC to positions",
        f"$BASE=$NULLFRAME\nPTP {{{kuka(0, more=turns(0))}}} C_PTP\nCIRC {{{kuka(1)}}},{{{kuka(2)}}} C_VEL\n",
        (0, 1, 2),
    ),
    Form(
        "extension of an editor: spline block",
        f"BAS(#BASE,0)\nSPLINE WITH $VEL.CP = 0.2\nSLIN {{{kuka(0)}}}\nSPL {{{kuka(1)}}}\nENDSPLINE\n",
        (0, 1),
    ),
    Form(
        "course notes: position that the program assigns",
        f"BAS(#BASE,0)\nE6POS MY_POSITION\nLIN {{{kuka(0)}}}\nMY_POSITION = {{{kuka(1)}}}\nLIN MY_POSITION\n",
        (0,),
        {5: "no literal"},
    ),
    Form(
        "RoboDK post for KUKA: base on an external axis by its number",
        f"$BASE = $NULLFRAME\nLIN {{{kuka(0)}}}\n"
        f"$BASE=EK(EX_AX_DATA[1].ROOT,EX_AX_DATA[1].EX_KIN, {{{frame_of(TABLE)}}})\nLIN {{{kuka(1, TABLE)}}}\n",
        (0,),
        {4: "carried by external axes"},
    ),
    Form(
        "filament winding: relative move",
        f"BAS(#BASE,0)\nLIN {{{kuka(0)}}}\nLIN_REL {{Z 10}} C_DIS\n",
        (0,),
        {3: "relative"},
    ),
    Form(
        "KRL reference: position of the system",
        f"BAS(#BASE,0)\nLIN {{{kuka(0)}}}\nLIN $POS_RET\n",
        (0,),
        {3: "the form of this move is not known"},
    ),
)


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.source)
def test_the_real_arm_reaches_the_targets_of_krl_forms_and_the_rest_is_listed(form: Form) -> None:
    assert_form(form, ".src")


BESIDE = {  # text, reason in the error
    "KSS 8.6 taught on a linear unit": (
        POINTS.replace("E1 0.0", "E1 2150.0") + DATA + LINE.format(0),
        "external axis E1 is at 2150: where it carries the arm or the part is not known",
    ),
    "one target elsewhere": (
        f"BAS(#BASE,0)\nLIN {{{kuka(0, more=ZERO)}}}\nLIN {{{kuka(1, more=',E1 2150')}}}\n",
        "line 2: external axis E1 moves: it is at 0 here, and at 2150 for other targets",
    ),
    "home of a linear unit": (
        f"BAS(#BASE,0)\nPTP {{{ARM},E1 2150}}\nLIN {{{kuka(0)}}}\n",
        "external axis E1 is at 2150 for other targets, and this one does not state it",
    ),
    "filament winding: relative moves of the mandrel": (
        f"BAS(#BASE,0)\nLIN {{{kuka(0)}}}\nLIN_REL {{Z 10, E1 360}} C_DIS\n",
        "external axis E1 is at 360 for other targets",
    ),
    "rotary bed of a scanner: PTP of a computed position": (
        f"$BASE=$NULLFRAME\nLIN {{{kuka(0)}}}\napos = $AXIS_ACT\napos.E1 = 40\nPTP apos\n",
        "line 2: external axis E1 is at 40 for other targets, and this one does not state it",
    ),
    "computed": (
        f"BAS(#BASE,0)\nLIN {{{kuka(0)},E1 angle+5}}\n",
        "external axis E1 is computed: where it carries",
    ),
}


@pytest.mark.parametrize(("text", "reason"), BESIDE.values(), ids=BESIDE)
def test_krl_targets_beside_external_axes_are_left_with_their_reason(text: str, reason: str) -> None:
    with pytest.raises(DataError) as caught:
        corrected(text, ".src")
    assert reason in str(caught.value)


def test_joint_targets_on_a_linear_unit_are_left_when_joint_targets_are_corrected() -> None:
    text = f"PTP {{{ARM},E1 2150}}\nPTP {{{ARM}}}\n"
    with pytest.raises(DataError, match="line 1: external axis E1 is at 2150"):
        corrected(text, ".src", joint_targets=True)
    assert len(corrected(text.replace("2150", "0"), ".src", joint_targets=True).names) == 2


def test_a_program_without_a_target_that_can_be_corrected_is_described() -> None:
    with pytest.raises(DataError) as caught:
        corrected(f"DEF a()\n{HOME}LIN_REL {{Z 5}}\nEND\n", ".src")
    says = str(caught.value)
    assert "2 motion instructions are in it, first in line 2: SPTP XHOME WITH" in says
    assert "no literal" in says
    with pytest.raises(DataError, match="no motion instruction is in it"):
        corrected("DEF a()\n; LIN XP1\nEND\n", ".src")


SRC = "DEF weld( )\n" + AXES.format(0) + LINE.format(1) + LINE.format(2) + "END"  # some end without a line break


def given(folder: Path, src: str, dat: str) -> list[str]:
    write_model(folder / "model.json", model())
    (folder / "weld.src").write_text(src)
    (folder / "weld.dat").write_text(dat)
    command = ["correct", str(folder / "model.json"), str(folder / "weld.src"), "--out", str(folder / "new.src")]
    return [*command, "--tool", *"000000", "--start", *map(str, np.degrees(Q[0]))]


def test_a_program_and_its_data_list_of_kss_8_5_are_corrected_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dat = f"DEFDAT weld\n{DATA}{POINTS}ENDDAT\n"
    assert run(given(tmp_path, SRC, dat)) == 0
    assert "3 of 3 poses corrected" in capsys.readouterr().out
    assert (tmp_path / "new.src").read_text() == SRC
    was, new = dat.splitlines(), (tmp_path / "new.dat").read_text().splitlines()
    assert [a.split("=")[0] for a, b in zip(was, new, strict=True) if a != b] == [f"DECL E6POS XP{i}" for i in range(3)]


def test_an_error_counts_the_lines_of_a_data_list_from_its_own_beginning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dat = f"DEFDAT weld\n{DATA}{POINTS.replace('E1 0.0', 'E1 2150.0')}ENDDAT\n"
    assert run(given(tmp_path, SRC, dat)) == 1
    says = " ".join(capsys.readouterr().err.split())
    assert "3 motion instructions are in it, first in line 2" in says
    assert "weld.dat line 4: XP0: external axis E1 is at 2150" in says
