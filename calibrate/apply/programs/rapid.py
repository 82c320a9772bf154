"""RAPID of ABB: robtargets [[x, y, z], [q1, q2, q3, q4], [cf1, cf4, cf6, cfx], [...]] and jointtargets; mm and degrees.

Source: ABB, RAPID reference manual, data types robtarget, confdata, jointtarget: the quaternion has its scalar first;
cf1, cf4 and cf6 are the quarter turns in which axes 1, 4 and 6 stand, 0 from 0 to 90 degrees, -1 from -90 to 0.
"""

import re
from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from calibrate.apply.correct.rotations import QUATERNION
from calibrate.apply.programs import literal
from calibrate.apply.programs.rapid_configurations import as_observed, observed_along, quarters
from calibrate.apply.programs.stated_frames import words_of


def _list(count: int) -> str:
    return rf"\[\s*{literal.NUMBER}(?:\s*,\s*{literal.NUMBER}){{{count - 1}}}\s*\]"


ROBTARGET = rf"(?P<pose>\[\s*{_list(3)}\s*,\s*{_list(4)}\s*,\s*{_list(4)}\s*,\s*{_list(6)}\s*\])"
JOINTTARGET = rf"(?P<joints>\[\s*{_list(6)}\s*,\s*{_list(6)}\s*\])"
TARGET = re.compile(f"{ROBTARGET}|{JOINTTARGET}")
POSE = rf"{_list(3)}\s*,\s*{_list(4)}"
OBJECT = re.compile(
    rf"\bwobjdata\s+(?P<name>\w+)\s*:=\s*\[\s*(?P<held>\w+)\s*,\s*(?P<fixed>\w+)\s*,[^,]*,"
    rf"\s*\[\s*(?P<user>{POSE})\s*\]\s*,\s*\[\s*(?P<object>{POSE})\s*\]\s*\]",
    re.IGNORECASE,
)
TOOL = re.compile(
    rf"\btooldata\s+(?P<name>\w+)\s*:=\s*\[\s*(?P<held>\w+)\s*,\s*\[\s*(?P<frame>{POSE})\s*\]", re.IGNORECASE
)
ASSIGNED = re.compile(r"\b(?P<name>\w++(?:\{[^{};]*\})?)(?:\.\w++)*+\s*+:=")
PARAMETER = re.compile(r"\b(?:wobjdata|tooldata)\s+(?P<name>\w+)\s*[,)|]", re.IGNORECASE)
USED = re.compile(r"\\WObj\s*:=\s*(?P<name>\w+)", re.IGNORECASE)
SHIFTED = re.compile(r"\bPDisp(?:Set|On)\b", re.IGNORECASE)
# Moves whose tool comes before what else they do; C has a target more, \Conc stands before the target.
PLAIN = re.compile(r"Move(C)?\w*\s+(\\\w+\s*$)?", re.IGNORECASE)
NAMED = re.compile(
    r"\b(?:robtarget|jointtarget)\s+(?P<name>\w+)\s*(?P<count>\{\s*\d+\s*\})?\s*:=\s*(?P<list>\[)?", re.IGNORECASE
)
PROCESS = r"(?:Arc|Cap|Cut|Disp|Paint|Spot|Trigg)[JLC]\w*"  # moves of the options: their target comes first, too
INSTRUCTION = rf"\b(?:Move\w+|{PROCESS})\s+(?:\\\w+\s*,\s*)?"
NAME = r"[A-Za-z_]\w*(?:\{[^{}]*\})?"
MOVE = re.compile(rf"{INSTRUCTION}(?P<target>\[|{NAME})", re.IGNORECASE)
# An arc has two targets: the point on the circle, and its end.
ROUND = r"\b(?:Move|Arc|Cap|Cut|Disp|Paint|Trigg)C\w*\s+(?:\\\w+\s*,\s*)?"
ARC = rf"{ROUND}(?:{NAME}(?:\((?:[^();]|\([^();]*\))*\))?|{ROBTARGET.replace('?P<pose>', '?:')})\s*,\s*"
ARC_END = re.compile(rf"{ARC}(?P<target>\[|{NAME})", re.IGNORECASE)
INLINE = re.compile(rf"(?:{INSTRUCTION}|{ARC})$", re.IGNORECASE)
REST = re.compile(r"\bMove\w+\s+(?:\[.*\]\]|\w+)\s*(?P<rest>(?:\\[^,]*)?,.*;)", re.IGNORECASE)
ROUTINE = re.compile(r"\b(?:PROC|RECORD)\s+(?P<name>\w+)", re.IGNORECASE)
# Behind the condition of an IF without THEN comes what is no operand any more.
IF = r"\bIF\b[^;\n]{0,99}?(?<=[\w)}])(?<!\bAND|\bXOR|\bNOT|\bDIV|\bMOD)(?<!\bOR|\bIF)\s+(?!(?:AND|X?OR|DIV|MOD|THEN)\b)"
CALLED = re.compile(
    rf"(?:^|;|\bTHEN\b|\bELSE\b|\bDO\b|{IF})[ \t]*(?!IF\b)(?P<name>[A-Z]\w*)(?=[ \t]*[;\\]|[ \t]+[\w\[(,-])",
    re.IGNORECASE | re.MULTILINE,
)
BUILT_IN = literal.built_in(rf"""
    IF ELSE ELSEIF END(?:IF|FOR|WHILE|TEST|PROC|FUNC|TRAP|RECORD|MODULE) FOR WHILE TEST CASE RETURN GOTO CONNECT RAISE
    RETRY TRYNEXT EXIT(?:CYCLE)? VAR PERS CONST LOCAL TASK PROC FUNC TRAP RECORD MODULE ALIAS ERROR UNDO BACKWARD d?num
    bool string pos orient pose robtarget jointtarget Move(?:AbsJ|ExtJ|[JLC](?:[ADG]O|Sync)?) Search(?:[JLC]|ExtJ)
    {PROCESS} SpotM[JL] Calib[JL] ArcRefresh Trigg(?:IO|Int|Equip|CheckIO|RampAO|Speed|StopProc|AbsJ|Data\w+)
    (?:Start|Stop)Move(?:Retry|Reset)? (?:Clear|Store|Resto|StepBwd)Path PathResol PathRec\w+ PathAccLim CirPathMode
    Conf[JL] SingArea AccSet VelSet Speed(?:Refresh|Lim\w+) WorldAccLim GripLoad MechUnitLoad Soft(?:Act|Deact|Elbow)
    (?:De)?Act(?:Unit|EventBuffer) SyncMove\w+ SyncToSensor SupSyncSensor\w+ (?:PDisp|EOffs)(?:On|Off|Set)
    Tune(?:Servo|Reset) Ind(?:[ACDR]Move|Reset) Corr(?:Con|Discon|Write|Clear) MotionSup MotionProcessModeSet CollDetect
    [MS]Tool\w+Calib ST(?:Calib|Close|Open|(?:Tune|IndGun)(?:Reset)?) SetForce (?:Set|Wait|ISignal)[ADG][IO] Set Reset
    PulseDO InvertDO Wait(?:Until|Time|Load|Rob|Sensor|SyncTask|TestAndSet|WObj) DropWObj AliasIO(?:Reset)?
    IO(?:Disable|Enable|Bus\w+) Set(?:AllDataVal|DataSearch|LeadThrough|upCyclicBool) [GS]et(?:DataVal|SysData)
    (?:Start|Un|Cancel)?Load EraseModule CheckProgRef Save(?:CfgData)? Stop Break CallByVar SystemStopAction RaiseToUser
    Err(?:Raise|Log|Write) SkipWarn ResetRetryCount ProcerrRecovery
    I(?:Delete|Timer|Sleep|Watch|Enable|Disable|Error|Pers|RMQMessage|VarValue) Add Clear Decr Incr
    Clk(?:Reset|Start|Stop) Bit(?:Clear|Set) \w+RawBytes PackDNHeader (?:Read|Write)(?:AnyBin|Block|CfgData|Var)
    Write(?:Bin|StrBin)? TextTabInstall WZ\w+ TP(?:Erase|Write|Show|Read\w+) UI(?:Show|Msg\w+) Open(?:Dir)?
    Close(?:Dir)? Rewind ClearIOBuff (?:Make|Remove)Dir (?:Copy|Remove|Rename)File Socket\w+ RMQ\w+ Spy(?:Start|Stop)
    TestSign\w+ WarmStart EGM\w+ Cam[A-Z]\w+""")
MOTION = re.compile(rf"\b(?P<go>(?:Move[A-Z]|{PROCESS}|Search[JLC])\w*[ \t]*[\s\\\[])", re.IGNORECASE)
EXTERNAL = tuple(f"eax_{letter}" for letter in "abcdef")
AXES_SET = re.compile(r"\.extax\s*(?:\.\s*(?P<axis>eax_[a-f])\s*)?:=\s*(?P<value>[^;]*)", re.IGNORECASE)
UNUSED = 8.9e9  # and above: 9E9 for an axis that is not there
LONGEST = 400  # letters between the beginning of a move and its last target


def find(text: str, n_joints: int) -> literal.Targets:
    """Of a module."""
    code = literal.blanked(text, "!")
    places = _places(code)
    by_name = literal.moves_of(text, code, (MOVE, ARC_END), places, ";")
    declared = {at: name for match in NAMED.finditer(code) for at, name in _declared(code, match)}
    literals: list[literal.Literal] = []
    for match in TARGET.finditer(code):
        first = max(code.rfind(";", 0, match.start()) + 1, match.start() - LONGEST)
        inline, name = INLINE.search(code[first : match.start()]), declared.get(match.start())
        if name is not None:
            literals.append(_literal(text, match, name, literal.moves_to(by_name, name)))
        elif inline:
            moves = (literal.instruction(text, first + inline.start(), places, ";"),)
            literals.append(_literal(text, match, f"line {literal.line_of(text, match.start())}", moves))
    observed = observed_along(code, _calls(code))
    literals = [as_observed(one, observed) for one in literals]
    skipped = literal.sentences(code, by_name, literals, ASSIGNED, literal.unread(text, code, TARGET, literals))
    if n_joints != 6:
        return literal.Targets((), (*skipped, f"RAPID targets have six axes, this arm has {n_joints}"))
    external = tuple(axis for match in AXES_SET.finditer(code) for axis in _axes_set(match))
    what = "displaces the program, or changes a work object or a tool"
    return literal.Targets(
        tuple(literals), skipped, literal.absent(code, _calls(code), ROUTINE, BUILT_IN, what), external
    )


def _axes_set(match: re.Match[str]) -> literal.Axes:
    """External axes that an assignment changes; NaN for one that is computed."""
    names = (match["axis"].lower(),) if match["axis"] else EXTERNAL
    values = [v.strip() for v in match["value"].strip().removeprefix("[").removesuffix("]").split(",")]
    if len(values) != len(names) or not all(re.fullmatch(literal.NUMBER, v) for v in values):
        return tuple((name, np.nan) for name in names)
    return tuple((name, float(v)) for name, v in zip(names, values, strict=True) if abs(float(v)) < UNUSED)


def _calls(code: str) -> Iterator[re.Match[str]]:
    """Statements that are a name, with or without arguments; no lines that go on with one."""
    for match in CALLED.finditer(code):
        if not code[max(0, match.start() - LONGEST) : match.start("name")].rstrip().endswith(tuple(",+-*/=<>([{\\")):
            yield match


def _declared(code: str, match: re.Match[str]) -> list[tuple[int, str]]:
    """Where the targets of a declaration begin, and their names: of an array one for each element, counted from 1."""
    if not match["count"]:
        return [(match.start("list"), match["name"])]
    end = code.find(";", match.end())
    elements = TARGET.finditer(code, match.end(), len(code) if end < 0 else end)
    return [(element.start(), f"{match['name']}{{{k}}}") for k, element in enumerate(elements, start=1)]


def _literal(text: str, match: re.Match[str], name: str, moves: tuple[literal.Move, ...]) -> literal.Literal:
    group = "pose" if match["pose"] else "joints"
    found: list[tuple[literal.Span, float]] = list(literal.numbers_in(text, *match.span(group)))
    taken = found[:7] if group == "pose" else found[:6]
    axes = tuple((name, v) for name, (_, v) in zip(EXTERNAL, found[-6:], strict=True) if abs(v) < UNUSED)
    spans, numbers = tuple(s for s, _ in taken), tuple(v for _, v in taken)
    branch, turns = quarters(found[7:11]) if group == "pose" else (None, None)
    return literal.Literal(
        name, match.start(group), spans, numbers, group == "joints", moves, branch, turns, None, (), axes
    )


def _places(code: str) -> literal.Places:
    """Work object and tool of an instruction; what the program assigns to is known to none before it runs."""
    times = Counter(match["name"].lower() for match in ASSIGNED.finditer(code))
    calls = (m for m in _calls(code) if not BUILT_IN.fullmatch(m["name"]))
    given = {word for m in calls for word in words_of(code[m.end() : m.end() + LONGEST].partition(";")[0])}
    held = {"wobj0": literal.NamedPose("wobj0", np.eye(4)), "tool0": literal.NamedPose("tool0", np.eye(4))}
    for match in (*OBJECT.finditer(code), *TOOL.finditer(code)):
        name, is_object = match["name"], match.re is OBJECT
        pose = np.eye(4)
        for group in ("user", "object") if is_object else ("frame",):
            pose = pose @ RAPID.frame([v for _, v in literal.numbers_in(code, *match.span(group))])
        why = f"{name} is given to a routine that may change it" if name.lower() in given else ""
        if is_object and (match["held"].upper(), match["fixed"].upper()) != ("FALSE", "TRUE"):
            why = f"work object {name} is held by a robot or moved by a unit, which is not corrected"
        elif not is_object and match["held"].upper() != "TRUE":
            why = f"tool {name} is stationary, which is not corrected"
        held[name.lower()] = literal.NamedPose(name, pose if times[name.lower()] == 1 else None, why)
    for match in PARAMETER.finditer(code):
        held[match["name"].lower()] = literal.NamedPose(refused=f"{match['name']} is a parameter of its routine")

    shifted = literal.NamedPose(refused="the program displaces its targets (PDispSet, PDispOn)")
    shifts = SHIFTED.search(code) is not None

    def places(at: int) -> tuple[literal.NamedPose, literal.NamedPose]:
        end = code.find(";", at, at + literal.LONGEST_MOVE)
        # An optional argument may stand behind a comma of its own.
        parts = literal.arguments(re.sub(r",\s*(?=\\)", " ", code[at : at + literal.LONGEST_MOVE if end < 0 else end]))
        k = 3 + sum(group is not None for group in plain.groups()) if (plain := PLAIN.match(parts[0])) else -1
        last = next((part for part in parts if USED.search(part)), parts[k] if k < len(parts) else "")
        used, tool = USED.search(last), last.split("\\")[0].strip()
        name = used["name"] if used else "wobj0"
        frame = shifted if shifts else held.get(name.lower(), literal.NamedPose(name))
        return frame, held.get(tool.lower(), literal.NamedPose(tool))

    return places


def overshoot(move: literal.Move, joints: Sequence[str]) -> str:
    """With the speed, zone and tool of the move that it stands before; the zone is `fine`, so that it is reached."""
    indent = move.text[: len(move.text) - len(move.text.lstrip())]
    match = REST.search(move.text)
    rest = ", v100, fine, tool0;" if match is None else match["rest"]
    parts = rest.lstrip(", ").split(",", 2)
    if len(parts) == 3:
        rest = f", {parts[0].strip()}, fine, {parts[2].strip()}"
    return f"{indent}MoveAbsJ [[{', '.join(joints)}], [9E9, 9E9, 9E9, 9E9, 9E9, 9E9]]{rest}"


RAPID = literal.Dialect("RAPID", "ABB", (".mod", ".prg", ".modx"), find, QUATERNION, True, 4, 8, overshoot, MOTION, "!")
