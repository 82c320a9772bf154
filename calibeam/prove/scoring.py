"""Scores one case: what was reported against what was hidden.

Places that no measurement of these instruments can separate count as one; each such rule has its reason. The rules
are few on purpose: where a diagnosis may answer "or", it has to name the alternative itself.

The noise that no model can explain is known, because the concealing side keeps the exact readings.

Error over the workspace is where the model puts the tool against where it truly is. Where the base frame stands is
nobody's error, so the best rigid motion between both is taken out first. A beam has no point that is its own: its error
is the distance of the true beam's points, at working distances, from the reported line.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples, read
from acquisition.recording.samples import POSITION, SPOTS
from calibeam.prove.concealing import Concealed
from calibeam.prove.diagnosing import Answered
from calibeam.prove.raised import FEW_ROWS, REPLAYED, SAID_OF_CONVENTION
from calibeam.prove.record import UNKNOWN, CaseScore, DefectScore, FreeSpace, NamedCause, SizeScore, TrueDefect, Truth
from calibeam.prove.scenario import Scenario
from calibeam.prove.seal import Layout
from calibeam.prove.unseen import LaserBeam, Tool, read_unseen
from calibrate.diagnose.record.file import read_diagnosis
from calibrate.diagnose.record.schema import DiagnosisFile, FindingRecord, NameRecord
from calibrate.fit.noise import sigma_about_zero
from calibrate.model.alignment import aligned_difference
from simulators.conceal.motion.driving import RATE_HZ
from simulators.world.model import STEP_S


@dataclass(frozen=True)
class Rule:
    """Two names of one place."""

    holds: Callable[[str, str, str], bool]  # true port, reported port, family
    reason: str
    names: frozenset[str] = frozenset()  # of causes at these places that are as equal as the places


def _all_links(true: str, said: str, family: str) -> bool:
    return true == "link*.length" and re.fullmatch(r"link(\d+|\*)\.length", said) is not None


def _one_stand(true: str, said: str, family: str) -> bool:
    return {true, said} == {"base.pose", "device.pose"} and family in ("tracker", "wire")


def _one_body(true: str, said: str, family: str) -> bool:
    return true in ALL_STATIONS and said in ("base.pose", true.replace("*", ""))


ALL_STATIONS = ("fixture*.pose", "seat*.position")
RULES = (
    Rule(_all_links, "all links grow together: whichever is named, the growth of the arm is meant"),
    Rule(
        _one_stand,
        "one device watches the arm: the base moved one way or the device the other way is the same to every reading",
        frozenset({"base-moved", "device-drift"}),
    ),
    Rule(
        _one_body,
        "all that watches the arm moved as one body: the base moved the other way is the same to every reading",
        frozenset({"base-moved", "fixture-moved", "seat-moved"}),
    ),
)


def same_place(true: str, said: str, family: str) -> str | None:
    """Why the reported port is the true one: "" the same word, else the reason of the rule; None: it is another."""
    if true == said:
        return ""
    return next((rule.reason for rule in RULES if rule.holds(true, said, family)), None)


def same_name(true: str, said: str, why: str) -> bool:
    """Whether two names are those of one cause, to every reading; `why` as given by `same_place`."""
    return true == said or any(rule.reason == why and {true, said} <= rule.names for rule in RULES)


Floats = NDArray[np.float64]

CHANNELS: dict[str, tuple[str, ...]] = {"dual-psd": SPOTS, "tracker": POSITION, "wire": ("wire_m",)}
OUTLIER_SIGMAS = 6.0  # sigmas: rows that every side of the comparison leaves out


def noise_m(samples: Samples, truth: Truth, family: str) -> Floats:
    """(sample, channel) what was really added to the readings of one of CHANNELS."""
    recorded = np.stack([samples.column(name) for name in CHANNELS[family]], axis=1)
    return np.asarray(recorded - np.array(truth.exact.values_m), dtype=np.float64)


def added_noise_m(layout: Layout, name: str, truth: Truth, family: str, rows: Sequence[int]) -> float:
    """Rms of what was added to these rows of a recording."""
    return float(np.sqrt(np.nanmean(noise_m(read(layout.recording(name)).samples, truth, family)[list(rows)] ** 2)))


def floor_m(samples: Samples, truth: Truth, family: str) -> float | None:
    """Rms of the noise over all readings but wild ones, m. None for cones: their noise is in the encoders."""
    if family not in CHANNELS:
        return None
    noise = noise_m(samples, truth, family)
    size = np.max(np.abs(noise), axis=1)
    return float(np.sqrt(np.mean(noise[size <= OUTLIER_SIGMAS * sigma_about_zero(noise)] ** 2)))


REACH_M = (0.08, 0.45)  # along a beam: from the nearest to the farthest detector of a session
TURNS = 6  # of Gauss-Newton for the best motion: errors are small, three are enough


def errors_m(said: Tool | None, truth: FreeSpace) -> float | None:
    """Rms over the poses, three axes together. None where the model states nothing, or not of the same tool."""
    if isinstance(said, LaserBeam):
        if truth.beam_origin_m is None or truth.beam_direction is None:
            return None
        return _beams_m(said, np.array(truth.beam_origin_m), np.array(truth.beam_direction))
    if said is None or truth.tip_m is None:
        return None
    return _rms(aligned_difference(np.array(truth.tip_m), said))


def _beams_m(said: LaserBeam, origin_m: Floats, direction: Floats) -> float:
    along = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    points = np.concatenate([origin_m + s * along for s in REACH_M])
    start = np.concatenate([said.origin_m] * len(REACH_M))
    line = np.concatenate([said.direction / np.linalg.norm(said.direction, axis=1, keepdims=True)] * len(REACH_M))
    turn, shift = Rotation.identity(), np.zeros(3)
    for _ in range(TURNS):
        away, d = _away(turn.apply(start) + shift, turn.apply(line), points)
        across = np.eye(3) - d[:, :, None] * d[:, None, :]
        step, *_ = np.linalg.lstsq(_slope(points, across), away.ravel(), rcond=None)
        small = Rotation.from_rotvec(step[3:])
        turn, shift = small * turn, small.apply(shift) + step[:3]
    return _rms(_away(turn.apply(start) + shift, turn.apply(line), points)[0])


def _away(start: Floats, line: Floats, points: Floats) -> tuple[Floats, Floats]:
    """(point, 3) from each line to its point, across the line; and the lines' directions."""
    span = points - start
    return span - np.sum(span * line, axis=1, keepdims=True) * line, line


def _slope(points: Floats, across: Floats) -> Floats:
    """(3 point, 6) by which the foot of each point moves across its line, by shift and turn [v; w] of the lines."""
    turned = np.cross(np.eye(3)[None, :, :], points[:, None, :])  # (point, axis, 3): w x p
    by = np.concatenate([np.broadcast_to(np.eye(3), (len(points), 3, 3)), np.swapaxes(turned, 1, 2)], axis=2)
    return (across @ by).reshape(-1, 6)


def _rms(errors: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))


FAILED = "failed"
BAD_SHOT = "bad shot"
OF_GEOMETRY = ("joint-zeros", "links")  # levels of a comparison
REPLAY_AGREES = 2.0  # times the noise that was added
TIED = 0.5  # of BIC: reported as equal
MOTION, DELAY = "motion", "torque-delay"
CONTROLLER_DELAY_S = 1.5 * STEP_S  # the middle of two steps, the newer of which began a step ago
BAND_HZ = 20.0  # of the low pass that a diagnosis of torques works behind: docs/motion-recordings.md
# Of white noise, by a fourth-order Butterworth low pass run both ways: the integral of 1 / (1 + x^8)^2 from 0 on is
# 0.898, a share of 0.898 of the band.
PASSED = float(np.sqrt(2.0 * 0.898 * BAND_HZ / RATE_HZ))


def score(layout: Layout, concealed: Concealed, answered: Answered, truth: Truth) -> CaseScore:
    """Of an opened seal and an answer; a diagnosis that did not end has reported nothing."""
    drawn, wanted = concealed.scenario, concealed.scenario.wanted
    if drawn.kind == "motion":
        return _motion_score(layout, concealed, answered, truth)
    file, constants = (None, ()) if answered.error else _answer(layout, drawn)
    own = _own(truth.defects, constants if file is None else (*file.findings, *constants), wanted.family)
    left = _left_over(file)
    defects = tuple(
        _defect(d, findings, left if drawn.trouble or d.physics == UNKNOWN else (), wanted.family)
        for d, findings in zip(truth.defects, own, strict=True)
    )
    t_s = read(layout.recording(drawn.name)).samples.column("t_s")
    defects = tuple(
        replace(d, located=True, unknown_there=True) if _rows_of_its_time(file, one, t_s) else d
        for d, one in zip(defects, truth.defects, strict=True)
    )
    if drawn.wanted.confused and _names_convention(file, answered.error):
        defects = tuple(replace(d, located=True, named=True, among_rivals=True) for d in defects)
    before_m, after_m = _free_space(layout.answer(drawn.name), truth)
    return CaseScore(
        name=drawn.name,
        sha256=concealed.sha256,
        kind="outside" if defects and all(d.physics == UNKNOWN for d in defects) else drawn.kind,
        family=wanted.family,
        places=wanted.places,
        samples=len(truth.exact.values_m),
        noise=wanted.noise,
        seed=wanted.seed,
        enr_wanted=wanted.enr,
        attempts=concealed.attempts,
        withheld=truth.withheld,
        verdict=FAILED if file is None else file.verdict,
        defects=defects,
        said=() if file is None else tuple(_said(f, truth, wanted.family) for f in file.findings),
        unexplained=file is not None and file.unexplained is not None,
        asks_for=file is not None and _asks_for(file, truth, defects),
        held_out_before_m=None if file is None else file.rms_before_m,
        held_out_after_m=None if file is None else file.rms_after_m,
        floor_m=floor_m(read(layout.recording(drawn.name)).samples, truth, wanted.family),
        free_space_before_m=before_m,
        free_space_after_m=after_m,
        cpu_s=answered.cpu_s,
        error=answered.error,
        path=drawn.path,
        trouble=drawn.trouble,
        holds=_holds(layout, concealed, truth, file, defects),
    )


def _motion_score(layout: Layout, concealed: Concealed, answered: Answered, truth: Truth) -> CaseScore:
    """Of torques: no samples, no tool, and a joint in the place of an instrument."""
    drawn, wanted = concealed.scenario, concealed.scenario.wanted
    recording = read(layout.recording(drawn.name))
    file = None if answered.error else read_diagnosis(layout.answer(drawn.name) / "diagnosis.json")
    if file is not None and drawn.path == "on wires":
        file = replace(file, findings=tuple(f for f in file.findings if not _of_controller(f, truth)))
    own, left = _own(truth.defects, () if file is None else file.findings, MOTION), _left_over(file)
    defects = tuple(_defect(d, f, left, MOTION) for d, f in zip(truth.defects, own, strict=True))
    return CaseScore(
        name=drawn.name,
        sha256=concealed.sha256,
        kind=drawn.kind,
        family=wanted.arm or "",
        places=0,
        samples=max(len(stream.host_s) for stream in recording.streams.values()),
        noise=wanted.noise,
        seed=wanted.seed,
        enr_wanted=0.0,
        attempts=concealed.attempts,
        withheld=(),
        verdict=FAILED if file is None else file.verdict,
        defects=defects,
        said=() if file is None else tuple(_said(f, truth, MOTION) for f in file.findings),
        unexplained=file is not None and file.unexplained is not None,
        asks_for=False,
        held_out_before_m=None,
        held_out_after_m=None,
        floor_m=None,
        free_space_before_m=None,
        free_space_after_m=None,
        cpu_s=answered.cpu_s,
        error=answered.error,
        path=drawn.path,
        torque_over_noise=None if file is None else torque_over_noise(file, truth.torque_sigma_nm),
    )


def _of_controller(finding: FindingRecord, truth: Truth) -> bool:
    """The emulated controller reports the mean torque of its last cycle with the angles of that cycle's end. That delay
    is truly there, at every joint, and no hidden mechanism.
    """
    delay = finding.parameters.get("delay_s")
    if finding.physics != DELAY or delay is None or delay.value is None or not delay.sigma:
        return False
    late = any((d.physics, d.port) == (DELAY, finding.where) for d in truth.defects)
    return not late and abs(delay.value - CONTROLLER_DELAY_S) < CONTROLLER_DELAY_S


def torque_over_noise(file: DiagnosisFile, sigma_nm: Sequence[float]) -> float | None:
    """Rms over the joints of the torque left on the unseen end, each over the noise that its low pass lets through."""
    joints = () if file.torques is None else file.torques.joints
    ratios = [
        one.unseen_after_nm / (sigma_nm[one.joint - 1] * PASSED) for one in joints if one.unseen_after_nm is not None
    ]
    return float(np.sqrt(np.mean(np.square(ratios)))) if ratios else None


def _answer(layout: Layout, drawn: Scenario) -> tuple[DiagnosisFile | None, tuple[FindingRecord, ...]]:
    """What was reported, and constants that two recordings differ by; no diagnosis where nothing could be sought."""
    if drawn.wanted.beside is None:
        return read_diagnosis(layout.answer(drawn.name) / "diagnosis.json"), ()
    said = msgspec.json.decode((layout.answer(drawn.name) / "compare.json").read_bytes())
    sides = {(one["where"], one["physics"]): one["side"] for one in said["differences"]}
    constants = tuple(_as_finding(one) for one in said["differences"] if one["level"] in OF_GEOMETRY)
    file = msgspec.convert(said["diagnosis"], DiagnosisFile | None)
    if file is None:
        return None, constants
    findings = tuple(_sided(f, sides.get((f.where, f.physics), "")) for f in file.findings)
    return replace(file, verdict=said["verdict"], findings=findings), constants


def _sided(finding: FindingRecord, side: str) -> FindingRecord:
    """Of a pair the simulation has what is hidden: on another side it is at another place. Sizes: of the simulation."""
    if side != "simulated":
        return replace(finding, where=f"{side or 'neither'}: {finding.where}")
    sizes = {n: p if p.value is None else replace(p, value=-p.value) for n, p in finding.parameters.items()}
    return replace(finding, parameters=sizes)


def _as_finding(one: dict[str, Any]) -> FindingRecord:
    """A constant of compare.json, for what is hidden of its kind."""
    nothing = {"depends_on": "", "shape": "constant", "order": None, "rivals": (), "share": None, "bic_gain": None}
    nothing |= {"held_out_gain": None, "confidence": 1.0, "p": 0.0, "parameters": one["sizes"]}
    return msgspec.convert(nothing | {k: one[k] for k in ("where", "physics", "says")}, FindingRecord)


def _holds(
    layout: Layout, concealed: Concealed, truth: Truth, file: DiagnosisFile | None, defects: Sequence[DefectScore]
) -> bool | None:
    """What the trouble asks beside its cause: that a replay agrees, that few rows are no mismatch without a cause, that
    constants are no effect.
    """
    drawn = concealed.scenario
    if drawn.trouble == REPLAYED:
        path = layout.replayed(drawn.name) / "reconcile.json"
        said = msgspec.json.decode(path.read_bytes()) if path.is_file() else {"unseen": ()}
        if not said["unseen"]:
            return False
        noise_m = added_noise_m(layout, drawn.name, truth, drawn.wanted.family, said["unseen_rows"])
        return bool(max(one["after_m"] for one in said["unseen"]) <= REPLAY_AGREES * noise_m)
    if drawn.trouble == FEW_ROWS:
        return (file is not None and file.verdict != "mismatch") or all(d.located for d in defects)
    if drawn.wanted.beside == "constants":
        return file is not None and not file.findings and file.unexplained is None
    return None


def _rows_of_its_time(file: DiagnosisFile | None, defect: TrueDefect, t_s: Floats) -> bool:
    """Whether something is reported to have stood elsewhere for rows that all lie within the time of a shift: a few
    rows do not show whether fixture, instrument or base did.
    """
    if file is None or file.unexplained is None or file.unexplained.depends_on != "time":
        return False
    rows = np.array([row - 1 for b in file.blunders if b.kind == BAD_SHOT for row in b.rows], dtype=np.intp)
    begin, end = (defect.figures.get(name, np.nan) for name in ("at_s", "until_s"))
    return len(rows) > 0 and bool(np.all((t_s[rows] >= begin) & (t_s[rows] <= end)))


def _names_convention(file: DiagnosisFile | None, error: str) -> bool:
    """Whether the recording was refused, or a fault of its files is reported, for the convention of the table."""
    reported = [error] if file is None else [b.says for b in file.blunders]
    return any(word in text.lower() for text in reported for word in SAID_OF_CONVENTION)


def _own(
    defects: Sequence[TrueDefect], findings: Sequence[FindingRecord], family: str
) -> list[tuple[FindingRecord, ...]]:
    """For each defect the findings that may count for it: those that are not worth more to another one.

    A name is that of one cause. `unknown` may stand for several at its place: a diagnosis does not part those.
    """
    worth = np.array([[_worth(d, f, family) for f in findings] for d in defects]).reshape(len(defects), len(findings))
    rows, columns = linear_sum_assignment(worth, maximize=True)
    owner = {int(c): int(r) for r, c in zip(rows, columns, strict=True) if worth[r, c] > 0.0}
    return [
        tuple(f for c, f in enumerate(findings) if f.physics == UNKNOWN or owner.get(c, row) == row)
        for row in range(len(defects))
    ]


def _worth(defect: TrueDefect, finding: FindingRecord, family: str) -> float:
    """Named, by its own driver, before named, before located."""
    why = same_place(defect.port, finding.where, family)
    if why is None:
        return 0.0
    if finding.physics != defect.physics and not _as_good(finding, defect, why):
        return 1.0
    return 20.0 if _same_driver(defect, finding) else 10.0


def _left_over(file: DiagnosisFile | None) -> tuple[str, ...]:
    """Places of what was reported as unexplained."""
    if file is None:
        return ()
    return tuple(u.where for u in (file.unexplained, *file.also_unexplained) if u is not None)


def _defect(defect: TrueDefect, findings: Sequence[FindingRecord], left: Sequence[str], family: str) -> DefectScore:
    """Of the findings that may count for it, and what is `left` unexplained, where a cause may be without a name."""
    unexplained = any(same_place(defect.port, w, family) is not None for w in left)
    there = [(f, why) for f in findings if (why := same_place(defect.port, f.where, family)) is not None]
    named = [(f, why) for f, why in there if f.physics == defect.physics or _as_good(f, defect, why)]
    rivals = [r for f in findings for r in f.rivals if _is(r, defect, family)]
    best, why = (named or there or [(None, "")])[0]
    return DefectScore(
        mechanism=defect.mechanism,
        physics=defect.physics,
        port=defect.port,
        depends_on=defect.drivers,
        enr=defect.enr,
        located=bool(there) or unexplained,
        equivalent=why,
        named=bool(named),
        driver=any(_same_driver(defect, f) for f, _ in named),
        among_rivals=bool(named or rivals),
        unknown_there=unexplained or any(f.physics == UNKNOWN for f, _ in there),
        sizes=() if best is None or not named or why else _sizes(defect, best),  # another place, another quantity
    )


def _as_good(finding: FindingRecord, defect: TrueDefect, why: str) -> bool:
    """A name that no reading can separate from the true one, if the answer states itself that it could be that."""
    tied = any(r.physics == defect.physics and r.margin < TIED for r in finding.rivals)
    return same_name(defect.physics, finding.physics, why) and tied


def _is(name: NameRecord, defect: TrueDefect, family: str) -> bool:
    return name.physics == defect.physics and same_place(defect.port, name.where, family) is not None


def _same_driver(defect: TrueDefect, finding: FindingRecord) -> bool:
    """At least one of the true ones: of a late clock or an arm that has not settled each joint is as good."""
    return not defect.drivers or bool(set(defect.drivers) & set(finding.depends_on.split(",")))


def _sizes(defect: TrueDefect, finding: FindingRecord) -> tuple[SizeScore, ...]:
    """Of every figure that both sides state."""
    out: list[SizeScore] = []
    for name, true in defect.figures.items():
        said = finding.parameters.get(name)
        if said is not None and said.value is not None and said.sigma:
            out.append(SizeScore(name, true, said.value, said.sigma))
    return tuple(out)


def _said(finding: FindingRecord, truth: Truth, family: str) -> NamedCause:
    near = [(d, same_place(d.port, finding.where, family)) for d in truth.defects]
    there = [(d, why) for d, why in near if why is not None]
    return NamedCause(
        where=finding.where,
        depends_on=finding.depends_on,
        physics=finding.physics,
        confidence=finding.confidence,
        says=finding.says,
        placed=bool(there),
        right=any(finding.physics in (d.physics, *d.also) or _as_good(finding, d, why) for d, why in there),
    )


def _asks_for(file: DiagnosisFile, truth: Truth, defects: tuple[DefectScore, ...]) -> bool:
    """No certain name, and the missing column by name; or the right cause without it."""
    if not truth.withheld:
        return False
    if all(d.named for d in defects):
        return True
    undecided = file.verdict == "undecidable" or file.unexplained is not None
    advised = [n.column for n in file.not_recorded] + list(file.next)
    return undecided and any(_stem(column) in text for column in truth.withheld for text in advised)


def _stem(column: str) -> str:
    """`approach` of approach1, `temp_link` of temp_link2_degC: a rig has one for every joint."""
    return column.removesuffix("_degC").rstrip("0123456789")


def _free_space(answer: Path, truth: Truth) -> tuple[float | None, float | None]:
    before, after = read_unseen(answer / "unseen.npz")
    return errors_m(before, truth.free_space), errors_m(after, truth.free_space)
