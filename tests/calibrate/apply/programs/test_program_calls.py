"""Bases and tools along the calls, branches and loops of a program: as the controller has them when it moves."""

import pytest

from calibrate.apply.programs import krl, rapid, urscript
from calibrate.apply.programs.rewriting import dialect_of

POINT = "LIN {X 1, Y 0, Z 0, A 0, B 0, C 0}\n"


def base(metres: float) -> str:
    return f"$BASE = {{X {1e3 * metres}, Y 0, Z 0, A 0, B 0, C 0}}\n"


def of_krl(text: str) -> list[float | str]:
    """Of each move in the order of the text: x of its base in metres, or why it is left as it is."""
    return [
        place.refused or (place.name if place.T is None else float(place.T[0, 3]))
        for place in (one.used[0][0] for one in krl.find(text, 6).literals)
    ]


def test_moves_behind_a_call_have_the_base_that_the_called_routine_sets() -> None:
    text = f"DEF main()\n{base(1)}{POINT}other()\n{POINT}nothing()\n{POINT}END\n"
    text += f"DEF other()\n{POINT}{base(2)}{POINT}END\nDEF nothing()\n$OUT[1] = TRUE\nEND\n"
    assert of_krl(text) == [1.0, 2.0, 2.0, 1.0, 2.0]


def test_a_base_is_followed_through_calls_within_calls() -> None:
    text = (
        f"DEF main()\n{base(1)}outer()\n{POINT}END\nDEF outer()\n{POINT}inner()\n{POINT}END\nDEF inner()\n{base(3)}END"
    )
    assert of_krl(text) == [3.0, 1.0, 3.0]


BRANCHES = {
    "a branch": f"IF $IN[1] THEN\n{base(2)}ENDIF\n",
    "one of two branches": f"IF $IN[1] THEN\n{base(2)}ELSE\n{base(3)}ENDIF\n",
    "a case": f"SWITCH k\nCASE 1\n{base(2)}CASE 2\n{base(3)}ENDSWITCH\n",
    "a loop": f"FOR k = 1 TO 2\n{base(2)}ENDFOR\n",
    "an early return": f"IF $IN[1] THEN\nRETURN\nENDIF\n{base(2)}",
    "a parameter": "$BASE = table\n",
    "a parameter as number": "BAS(#BASE, n)\n",
    "a number at run time": "$BASE = BASE_DATA[k]\n",
    "itself": f"{base(2)}seam()\n",
}


@pytest.mark.parametrize("body", BRANCHES.values(), ids=BRANCHES)
def test_a_base_that_is_not_plain_in_the_called_routine_is_named(body: str) -> None:
    text = f"DEF main()\n{base(1)}seam(t, 2)\n{POINT}{base(4)}{POINT}END\nDEF seam(table:IN, n:IN)\n{body}END\n"
    assert of_krl(text) == ["the base is set in the called routine seam", 4.0]


def test_a_loop_is_entered_from_its_end_too() -> None:
    says = "the base is set in a branch or a loop above, or not"
    text = f"DEF main()\n{base(1)}LOOP\n{POINT}{base(2)}{POINT}ENDLOOP\nEND\n"
    assert of_krl(text) == [says, 2.0]
    assert of_krl(text.replace(f"LOOP\n{POINT}", f"LOOP\n{base(1)}{POINT}")) == [1.0, 2.0]


def test_a_target_behind_a_label_is_left_with_its_reason() -> None:
    (says,) = of_krl(f"DEF a()\n{base(1)}IF $IN[1] THEN\nGOTO on\nENDIF\n{base(2)}on:\n{POINT}END\n")
    assert says == "the base is not the same on all ways to the label on"


DATA = {metres: base(metres).replace("$BASE", "BASE_DATA[1]") for metres in (3, 4)}
OTHERS = f"DEFFCT INT check()\n{base(2)}ENDFCT\nDEFFCT INT other(n:IN)\n{base(3)}ENDFCT\nDEF early()\nIF a THEN\n"
OTHERS += f"RETURN check()\nENDIF\nEND\nDEF init()\n{DATA[3]}t.X = 5\nEND\nDEF shift(f:OUT)\nEND\n"
USE = f"BAS(#BASE, 1)\n{POINT}"
FDAT = f"DECL FDAT FP1 = {{TOOL_NO 0, BASE_NO 1}}\nDECL E6POS XP1 = {POINT[4:]}{DATA[4]}"
WAYS = {  # behind base 1; bases of its moves, None: left
    "forth": (f"IF $IN[1] THEN\nGOTO on\nENDIF\n{base(2)}{POINT}ON:\n{POINT}{base(3)}{POINT}", [2.0, None, 3.0]),
    "back": (f"again:\n{POINT}{base(2)}{POINT}IF $IN[1] THEN\nGOTO again ; once more\nENDIF\n", [None, 2.0]),
    "back with the same": (f"again:\n{POINT}IF $IN[1] THEN\nGOTO again\nENDIF\n{POINT}", [1.0, 1.0]),
    "over another branch": (f"GOTO a\nb:\n{POINT}GOTO c\na:\n{base(2)}{POINT}GOTO b\nc:\n{POINT}", [2.0, 2.0, 2.0]),
    "out of a loop": (f"LOOP\n{base(2)}IF $IN[1] THEN\nGOTO off\nENDIF\n{base(1)}ENDLOOP\noff:\n{POINT}", [None]),
    "where nothing leads": (f"GOTO off\n{POINT}off:\n{POINT}", [None, 1.0]),
    "branches that agree": (f"IF a THEN\n{base(2)}{POINT}ELSE\n{base(2)}ENDIF\n{POINT}", [2.0, 2.0]),
    "one branch": (f"IF a THEN\n{base(2)}{POINT}ENDIF\n{POINT}", [2.0, None]),
    "condition and else": (f"IF check() THEN\n{POINT}ELSE\n{POINT}ENDIF\n{POINT}", [2.0, 2.0, 2.0]),
    "condition and case": (f"SWITCH check()\nCASE 1\n{POINT}CASE 2\n{POINT}ENDSWITCH\n", [2.0, 2.0]),
    "default": (f"SWITCH k\nCASE 1\n{base(2)}DEFAULT\n{base(2)}ENDSWITCH\n{POINT}", [2.0]),
    "no default": (f"SWITCH k\nCASE 1\n{base(2)}CASE 2\n{base(2)}ENDSWITCH\n{POINT}", [None]),
    "while": (f"WHILE check()\n{base(1)}ENDWHILE\n{POINT}", [None]),
    "until": (f"REPEAT\n{POINT}UNTIL check() > 1\n", [None]),
    "return": (f"early()\n{POINT}", [None]),
    "call in a call": (f"k = other(check())\n{POINT}", [3.0]),
    "frame of a point": (f"{FDAT}LIN XP1\n", [None]),
    "the same frame": (f"{FDAT}{base(4)}LIN XP1\n", [4.0]),
    "data in a branch": (f"IF a THEN\n{DATA[3]}ENDIF\n{USE}", [None]),
    "data behind": (f"{USE}{DATA[3]}{USE}", [None, 3.0]),
    "index": (f"{DATA[3]}BASE_DATA[i].X = 5\n{USE}", [None]),
    "by reference": (f"{DATA[3]}shift(BASE_DATA[1])\n{USE}", [None]),
    "not given": (f"{DATA[3]}shift(BASE_DATA[1].X, 2)\n{USE}", [3.0]),
    "a name of two routines": (f"t = {POINT[4:]}init()\n$BASE = t\n{POINT}", [None]),
    "data of a called routine": (f"init()\n{USE}", [3.0]),
}


@pytest.mark.parametrize(("body", "bases"), WAYS.values(), ids=WAYS)
def test_moves_have_the_base_and_the_frame_data_of_the_way_to_them(body: str, bases: list[float | None]) -> None:
    found = of_krl(f"DEF main()\n{base(1)}{body}END\n{OTHERS}")
    assert [None if isinstance(one, str) else one for one in found] == bases


def test_a_routine_that_an_interrupt_starts_has_no_known_base() -> None:
    text = f"DEF main()\n{base(1)}INTERRUPT DECL 3 WHEN $IN[1] DO stop()\n{POINT}END\nDEF stop()\n{POINT}END\n"
    assert of_krl(text) == [1.0, "the base is that of any moment at which stop may be started"]
    text = text.replace("DEF stop()\n", f"DEF stop()\n{base(2)}")
    assert of_krl(text) == ["the base is set in the called routine stop", 2.0]


def test_a_frame_that_changes_or_is_computed_is_not_known() -> None:
    frame = "{X 1000, Y 0, Z 0, A 0, B 0, C 0}"
    assert of_krl(f"FRAME table = {frame}\n$BASE = table\n{POINT}") == [1.0]
    assert of_krl(f"FRAME table = {frame}\ntable.X = 7\n$BASE = table\n{POINT}") == ["TABLE"]
    assert of_krl(f"FRAME table = {frame} : shift\n$BASE = table\n{POINT}") == ["TABLE"]
    assert "X1000" in str(of_krl(f"$BASE = {frame} : {frame}\n{POINT}")[0])


def test_blocks_within_blocks_take_no_time() -> None:
    deep = 40
    text = f"LOOP\n{base(1)}{POINT}" * deep + f"{base(2)}ENDLOOP\n" * deep
    assert of_krl(f"DEF main()\n{text}END\n") == [1.0] * deep


def test_a_work_object_that_is_a_parameter_is_not_that_of_the_module() -> None:
    pose = "[[0,0,0],[1,0,0,0]]"
    text = (
        f'PERS wobjdata table := [FALSE,TRUE,"",{pose},{pose}];\n'
        f"PERS tooldata torch := [TRUE,{pose},[1,[0,0,1],[1,0,0,0],0,0,0]];\nPROC seam(PERS wobjdata table)\n"
        "MoveL [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]], v50, fine, torch\\WObj:=table;\nENDPROC\n"
    )
    (frame,), (tool,) = rapid.find(text, 6).literals[0].used
    assert frame.refused == "table is a parameter of its routine"
    assert not tool.refused


@pytest.mark.parametrize(
    "move", [r"MoveL \Conc,{},v9,z1", "MoveC p1,{},v9,z1", "ArcC p1,{},v9,a,b,z1", "TriggL {},v9,a,z1"]
)
def test_the_tool_of_a_move_in_no_work_object(move: str) -> None:
    text = move.format("[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]")
    for last in ("tool1;", r"tool1\Corr;"):
        assert rapid.find(f"{text},{last}", 6).literals[0].used[1][0].name == "tool1"


def tcp(metres: float) -> str:
    return f"set_tcp(p[{metres}, 0, 0, 0, 0, 0])\n"


def of_urscript(text: str) -> list[float | str]:
    """Of each move in the order of the text: x of its tool in metres, or why it is left as it is."""
    return [
        place.refused or (place.name if place.T is None else float(place.T[0, 3]))
        for place in (one.used[1][0] for one in urscript.find(text, 6).literals)
    ]


MOVEL = "movel(p[1, 2, 3, 0, 0, 0])\n"


def test_a_function_has_the_tool_of_its_callers_not_the_one_above_it_in_the_text() -> None:
    text = f"def weld():\n{tcp(1)}def seam():\n{MOVEL}end\n{tcp(2)}seam()\n{MOVEL}end\n"
    assert of_urscript(text) == [2.0, 2.0]
    twice = text.replace("seam()\nmovel", f"seam()\n{tcp(3)}seam()\nmovel")
    assert of_urscript(twice) == ["the tool is not the same at all calls of its routine", 3.0]


def test_moves_behind_a_call_have_the_tool_that_the_called_function_sets() -> None:
    text = f"def weld():\ndef grip():\n{tcp(2)}end\n{tcp(1)}{MOVEL}grip()\n{MOVEL}end\n"
    assert of_urscript(text) == [1.0, 2.0]
    branch = text.replace(tcp(2), f"if digital_in(1):\n{tcp(2)}end\n")
    assert of_urscript(branch) == [1.0, "the tool is set in the called routine grip"]
    parameter = text.replace(f"grip():\n{tcp(2)}", "grip(tip):\nset_tcp(tip)\n")
    assert of_urscript(parameter) == [1.0, "the tool is set in the called routine grip"]


def test_a_function_that_nothing_in_the_file_calls_has_no_known_tool() -> None:
    text = f"def weld():\n{tcp(1)}{MOVEL}end\ndef seam():\n{MOVEL}end\n"
    assert of_urscript(text) == [1.0, "the caller"]
    assert of_urscript(text.replace(tcp(1), "")) == ["", ""]


def test_a_tool_that_is_set_in_the_main_loop_holds_behind_it_only_where_both_ways_agree() -> None:
    text = f"def weld():\n{tcp(1)}while True:\n{MOVEL}if ready():\n{tcp(1)}else:\n{tcp(1)}end\nend\n{MOVEL}end\n"
    assert of_urscript(text) == [1.0, 1.0]
    says = "the tool is set in a branch or a loop above, or not"
    assert of_urscript(text.replace(f"else:\n{tcp(1)}", f"else:\n{tcp(2)}")) == [says, says]


def test_a_thread_may_set_the_tool_at_any_moment() -> None:
    text = f"def weld():\nthread hand():\n{tcp(2)}end\n{tcp(1)}run hand()\n{MOVEL}end\n"
    assert of_urscript(text) == ["the tool is set in the called routine hand"]


def test_calls_in_conditions_of_urscript_come_before_their_branches() -> None:
    grip = f"def weld():\ndef grip():\n{tcp(2)}end\n{tcp(1)}"
    assert of_urscript(f"{grip}if grip(): {tcp(3)}else: {MOVEL}end\nend\n") == [2.0]
    assert of_urscript(f"{grip}if a:\n{MOVEL}elif grip():\n{MOVEL}else:\n{MOVEL}end\nend\n") == [1.0, 2.0, 2.0]


POSE = "{X 1, Y 0, Z 0, A 0, B 0, C 0}"


def test_a_base_of_one_move_is_that_of_this_move_only() -> None:
    other, tool = "{X 2000, Y 0, Z 0, A 0, B 0, C 0}", "$TOOL = {X 0, Y 0, Z 7000, A 0, B 0, C 0}"
    text = (
        f"DECL E6POS XP1 = {POSE}\nDEF a()\n{base(1)}SLIN XP1 WITH $VEL.CP = 0.2, $BASE = {other}, {tool}\n{POINT}END\n"
    )
    first, second = krl.find(text, 6).literals
    assert [float(pose.T[0, 3]) for pose in (first.used[0][0], second.used[0][0]) if pose.T is not None] == [2.0, 1.0]
    assert [float(pose.T[2, 3]) for pose in first.used[1] if pose.T is not None] == [7.0]
    assert second.used[1][0].name == ""
    assert of_krl(text.replace(other, "jig")) == ["JIG", 1.0]
    assert of_krl(text.replace(other, "jigs[k]")) == ["the pose of JIGS[K] is chosen while the program runs", 1.0]


def test_the_form_of_a_move_with_the_frames_of_its_fdat() -> None:
    text = (
        "BASE_DATA[2] = {X 2000, Y 0, Z 0, A 0, B 0, C 0}\nTOOL_DATA[3] = {X 0, Y 0, Z 3000, A 0, B 0, C 0}\n"
        f"DECL FDAT FP1 = {{TOOL_NO 3, BASE_NO 2}}\nDECL FDAT FP9 = {{TOOL_NO 0, BASE_NO 0}}\nDECL E6POS XP9 = {POSE}\n"
        f"DEF a()\n{base(1)}SPTP XP9 WITH $VEL_AXIS[1]=SVEL_JOINT(9.0), $TOOL=STOOL2(FP1), $BASE=SBASE(FP1)\nEND\n"
    )
    (frame,), (tool,) = krl.find(text, 6).literals[0].used
    assert frame.name == "BASE_DATA[2]"
    assert tool.name == "TOOL_DATA[3]"


def test_a_work_object_that_a_called_routine_may_change_is_left() -> None:
    pose = "[[0,0,0],[1,0,0,0]]"
    move = "MoveL [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]], v50, fine, tool0"
    text = f'PERS wobjdata w1 := [FALSE,TRUE,"",{pose},{pose}];\nPROC main()\nsetup w1;\n{move}\\WObj:=w1;\nENDPROC\n'
    for call, says in (("setup w1;", "w1 is given to a routine that may change it"), ("setup;", "")):
        assert rapid.find(text.replace("setup w1;", call), 6).literals[0].used[0][0].refused == says


def test_the_base_of_a_spline_block_ends_with_the_block() -> None:
    header = base(2).replace("$BASE", "SPLINE WITH $BASE")
    text = f"DEF a()\n{base(1)}{header}SLIN {POSE}\nENDSPLINE\n{POINT}END\n"
    assert of_krl(text) == [2.0, 1.0]


ABSENT = {  # text, names that are listed, and their lines
    ".src": (
        """EXT BAS (BAS_COMMAND :IN, REAL :IN)
EXT GRIP ()
DEF main()
BAS (#INITMOV, 0)
INTERRUPT DECL 3 WHEN $STOPMESS DO IR_STOPM ( )
IF (k == 1) THEN
  Grip (1)
ENDIF
own()
WAIT FOR ($IN[1])
GRIP(2) ; FOO()
PULSE ($OUT[1], TRUE, 1)
TRIGGER WHEN DISTANCE=0 DELAY=0 DO glue(1) PRIO=-1
x = SIN(y)
END
DEF own()
END
""",
        [("Grip", 7), ("glue", 13)],
    ),
    ".mod": (
        r"""MODULE weld
  RECORD part
    num n;
  ENDRECORD
  PERS tooldata
    torch := [TRUE];
  PROC main()
    AccSet 50, 50;
    Own 1;
    MoveL p10, v50,
      fine, tool0;
    GripOn \Fast;
    TPWrite "a; Foo;";
    IF a = 1 AND NOT b Pick;
    IF a = 1 Set do1;
    IF a THEN Place p10, 2; ELSE Stop; ENDIF
    x := 5;
    again:
    GOTO again;
    GripOn; ! Foo;
    MoveHome;
    WaitDI di1, 1;
  ERROR
    RETRY;
  ENDPROC
  LOCAL PROC own(num n)
  ENDPROC
ENDMODULE
""",
        [("GripOn", 12), ("Pick", 14), ("Place", 16), ("MoveHome", 21)],
    ),
    ".script": (
        """def weld():
  set_standard_digital_out(0, True)
  if (get_digital_in(1) and not(False)):
    grip(1)
  end
  seam()
  gripper.close(1)
  movel(pose_trans(get_actual_tcp_pose(), p[0,0,0,0,0,0]))
  x = grip(2) # foo()
  set_tool_2()
  def seam():
  sync()
  end
end
""",
        [("grip", 4), ("set_tool_2", 10)],
    ),
}


@pytest.mark.parametrize("suffix", ABSENT)
def test_a_routine_that_the_file_does_not_hold_is_listed_once(suffix: str) -> None:
    text, names = ABSENT[suffix]
    dialect = dialect_of(suffix)
    assert dialect is not None
    found = dialect.find(text, 6).absent
    assert [sentence.split(" is not in this file")[0] for sentence in found] == [f"line {n}: {one}" for one, n in names]
    assert all("wrong" in sentence for sentence in found)
