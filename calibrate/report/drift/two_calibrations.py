"""Two calibrations of one arm side by side: what changed, what it does to the tool, and whether they can be compared.

Only what both determine is compared, and only what is of the arm itself: where base, target, laser, fixture or cones
stand differs from session to session without any drift of the arm. Several parameters are compared, so one is called
changed only where chance would bring such a change to any of them in one comparison of a hundred (Bonferroni: Dunn, J.
American Statistical Association 56, 1961). Both sigmas add in quadrature; where both owe something to the same nominal
values that is too careful, never too bold. Corrections about different nominal values are compared by their sums.

What the change of the arm does to the tool: base and tool the same, only what both sessions determine is changed.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from acquisition.recording import Recording
from acquisition.recording.rig import ArmModel, Joint, Rig, parse_rig
from calibrate.diagnose.record.schema import DiagnosisFile
from calibrate.errors import DataError
from calibrate.fit.accuracy import Alarm, target_by_parameter
from calibrate.model.model_file import Covariance, ModelFile, ModelParameter
from calibrate.model.parameters import index_of
from calibrate.model.predict import rig_in_model
from calibrate.report.elements.verdict import UNLIKELY
from calibrate.report.evidence.model_tests import repeated, scatter
from calibrate.report.workspace.workspace_errors import (
    KnownArm,
    Room,
    room_of,
    target_at,
)

BEHIND = (("offset", "d_m"), ("length", "a_m"), ("twist", "alpha_rad"))  # of the link behind a joint
IN_FRONT = ("length", "twist")  # in a modified table these are of the link in front of it (arms/mdh.py)


def rig_of(model: ModelFile, label: str) -> Rig:
    """The rig in a model.json, its arm in the model that was fitted. DataError where the file is of an older program.

    RigFileError where its text is damaged.
    """
    if model.rig.text is None:
        raise DataError(
            f"{label}: the model does not hold its rig file, so the nominal values of its corrections are unknown; "
            "give the recording, or identify it again"
        )
    return rig_in_model(parse_rig(model.rig.text, f"{label} (rig)"), ArmModel(model.arm_model))


def drawn_values(rig: Rig) -> dict[str, float]:
    """Value on the drawing by the name of its correction; a tilt is on no drawing. Of a table of either kind."""
    out: dict[str, float] = {}
    modified = rig.arm.model is ArmModel.MDH
    for i, joint in enumerate(rig.arm.joints, start=1):
        out[f"joint{i}.zero"] = joint.theta_offset_rad or 0.0
        for what, key in BEHIND:
            link = i - 1 if modified and what in IN_FRONT else i
            out[f"link{link}.{what}"] = getattr(joint, key) or 0.0
    return out


def redrawn(now: Rig, then: Rig) -> frozenset[str]:
    """Owners ('joint3', 'link3') of parameters whose corrections are about drawings that no number joins.

    Of fixed parts in space (local-poe) those that differ; of the flange the last link and joint.
    """
    n = len(now.arm.joints)
    out: set[str] = set()
    if now.arm.flange != then.arm.flange:
        out |= {f"link{n}", f"joint{n}"}
    if now.arm.model is ArmModel.LOCAL_POE:
        pairs = enumerate(zip(now.arm.joints, then.arm.joints, strict=True))
        out |= {f"link{i}" for i, (a, b) in pairs if _part(a) != _part(b)}
    return frozenset(out)


def _part(joint: Joint) -> tuple[object, object]:
    return joint.origin_m, joint.rotation_rad


Floats = NDArray[np.float64]

FAMILY = 0.01  # chance that any of all unchanged parameters is called changed
OF_THE_ARM = ("joint", "link")
SPARE = 1e-12  # of the largest: a direction in which the uncertainty is rounding


@dataclass(frozen=True)
class Change:
    """One parameter, drawing and correction together; angles differ by less than half a turn."""

    name: str
    unit: str
    now: float
    then: float
    sigma: float  # of the change
    significant: bool

    @property
    def change(self) -> float:
        off = self.now - self.then
        return math.remainder(off, 2.0 * math.pi) if self.unit == "rad" else off

    @property
    def sigmas(self) -> float:
        """Size of the change over its uncertainty."""
        return abs(self.change) / self.sigma


@dataclass(frozen=True)
class Together:
    """All changes at once: chi-square of as many, and the chance of one as large where nothing changed."""

    chi2: float
    dof: int
    p: float

    @property
    def significant(self) -> bool:
        return self.p < FAMILY


@dataclass(frozen=True)
class Compared:
    """What can be compared, and what cannot, with the reason."""

    changes: tuple[Change, ...]
    limit_sigmas: float  # from here on a change is no chance
    together: Together | None  # None where nothing can be compared, or a covariance is missing
    left_out: tuple[tuple[str, str], ...]  # name, why

    @property
    def significant(self) -> tuple[Change, ...]:
        """The clearest first."""
        return tuple(sorted((c for c in self.changes if c.significant), key=lambda c: -c.sigmas))


def compared(now: ModelFile, rig_now: Rig, then: ModelFile, rig_then: Rig) -> Compared:
    """Of two models of one kind of arm with as many joints; rigs as in their models."""
    ours, theirs = ({p.name: p for p in model.parameters if _of_the_arm(p.name)} for model in (now, then))
    moved = redrawn(rig_now, rig_then)
    whys = {name: _why_not(ours.get(name), theirs.get(name), moved) for name in dict.fromkeys((*ours, *theirs))}
    both = [name for name, why in whys.items() if why is None]
    limit = float(norm.isf(FAMILY / (2.0 * max(len(both), 1))))
    drawn_now, drawn_then = drawn_values(rig_now), drawn_values(rig_then)
    changes = tuple(
        _change(ours[name], theirs[name], drawn_now.get(name, 0.0), drawn_then.get(name, 0.0), limit) for name in both
    )
    left_out = tuple((name, why) for name, why in whys.items() if why is not None)
    return Compared(changes, limit, _together(changes, now, then), left_out)


def _of_the_arm(name: str) -> bool:
    return name.partition(".")[0].rstrip("0123456789") in OF_THE_ARM


def _why_not(now: ModelParameter | None, then: ModelParameter | None, moved: frozenset[str]) -> str | None:
    determined = [p is not None and p.value is not None and p.sigma is not None for p in (now, then)]
    if not any(determined):
        return "determined by neither"
    if not all(determined):
        return "determined only then" if determined[1] else "determined only now"
    if now is not None and now.name.partition(".")[0] in moved:
        return "drawn differently in the two rig files"
    return None


def _change(now: ModelParameter, then: ModelParameter, drawn_now: float, drawn_then: float, limit: float) -> Change:
    values = drawn_now + (now.value or 0.0), drawn_then + (then.value or 0.0)
    sigma = math.hypot(now.sigma or 0.0, then.sigma or 0.0)
    one = Change(now.name, now.unit, *values, sigma, significant=False)
    return Change(now.name, now.unit, *values, sigma, significant=one.sigmas > limit)


def covariance_of_changes(changes: tuple[Change, ...], now: ModelFile, then: ModelFile) -> Floats | None:
    """(change, change) covariance of the changes; None where one of the models has none."""
    if now.covariance is None or then.covariance is None:
        return None
    names = [c.name for c in changes]
    return _among(now.covariance, names) + _among(then.covariance, names)


def _among(record: Covariance, names: list[str]) -> Floats:
    at = [record.names.index(name) for name in names]
    return np.array(record.rows)[np.ix_(at, at)]


def _together(changes: tuple[Change, ...], now: ModelFile, then: ModelFile) -> Together | None:
    covariance = covariance_of_changes(changes, now, then)
    if covariance is None or not changes:
        return None
    scale = np.sqrt(np.diag(covariance))
    size, directions = np.linalg.eigh(covariance / np.outer(scale, scale))
    seen = size > SPARE * size[-1]
    along = directions[:, seen].T @ (np.array([c.change for c in changes]) / scale)
    total, dof = float(np.sum(along**2 / size[seen])), int(seen.sum())
    return Together(total, dof, float(chi2.sf(total, dof)))


@dataclass(frozen=True)
class Calibration:
    """One of the two: its model, and what else there is of it."""

    label: str  # when or where from, for a person
    model: ModelFile
    recording: Recording | None = None
    diagnosis: DiagnosisFile | None = None


@dataclass(frozen=True)
class ToolChange:
    """At the poses of a Room."""

    moved_m: Floats  # (pose,) distance between the tool now and then
    sigma_m: Floats  # (pose,) uncertainty of it, three axes together
    largest_m: float  # over the supported poses
    largest_sigma_m: float  # there


def tool_change(known: KnownArm, room: Room, changes: tuple[Change, ...], covariance: Floats) -> ToolChange:
    """`covariance` (change, change): covariance of the changes."""
    column = index_of(known.parameters)
    own = [column[c.name] for c in changes]
    then = known.theta.copy()
    then[own] -= np.array([c.change for c in changes])
    moved = np.linalg.norm(target_at(known, known.theta, room.q_rad) - target_at(known, then, room.q_rad), axis=1)
    J = target_by_parameter(known.arm, known, known.point_m, room.q_rad)[1][..., own]
    sigma = np.sqrt(np.maximum(np.einsum("nip,pq,niq->n", J, covariance, J, optimize=True), 0.0))
    worst = int(np.argmax(np.where(room.supported, moved, -1.0)))
    return ToolChange(moved, sigma, float(moved[worst]), float(sigma[worst]))


@dataclass(frozen=True)
class Drift:
    """All of the comparison."""

    now: Calibration
    then: Calibration
    compared: Compared
    room: Room | None  # None where no error over the workspace can be determined
    tool: ToolChange | None  # the same, or nothing to compare
    warnings: tuple[str, ...]

    @property
    def found(self) -> bool:
        """Whether anything changed by more than chance gives."""
        joint = self.compared.together
        return bool(self.compared.significant) or (joint is not None and joint.significant)


def drift_of(now: Calibration, then: Calibration, known: KnownArm | str) -> Drift:
    """`known`: the arm of `now`. DataError for arms that cannot be compared at all, naming what differs."""
    rig_now = _rig(now)
    rig_then = _rig(then)
    if len(rig_now.arm.joints) != len(rig_then.arm.joints):
        raise DataError(
            f"report: {then.label} is of an arm with {len(rig_then.arm.joints)} joints, this one has "
            f"{len(rig_now.arm.joints)}; give a calibration of the same arm"
        )
    if now.model.arm_model != then.model.arm_model:
        raise DataError(
            f"report: {then.label} is fitted as '{then.model.arm_model}', this one as '{now.model.arm_model}': their "
            "parameters mean different things; identify one of them again with the model of the other (--plan)"
        )
    found = compared(now.model, rig_now, then.model, rig_then)
    covariance = covariance_of_changes(found.changes, now.model, then.model)
    room = None if isinstance(known, str) else room_of(known)
    tool = None
    if room is not None and not isinstance(known, str) and covariance is not None and found.changes:
        tool = tool_change(known, room, found.changes, covariance)
    warnings = (*_other_arm(rig_now, rig_then), *_more_than_noise(now, then))
    return Drift(now, then, found, room, tool, warnings)


def _rig(one: Calibration) -> Rig:
    if one.recording is None:
        return rig_of(one.model, one.label)
    return rig_in_model(one.recording.rig, ArmModel(one.model.arm_model))


def _more_than_noise(now: Calibration, then: Calibration) -> Iterator[str]:
    """Parameters bend to imitate missing physics, and do so differently at other poses."""
    short = [one.label for one in (then, now) if _lacks_physics(one.model)]
    if short:
        yield (
            f"The model of {' and of '.join(short)} leaves more than noise, so its sigmas are too small: measuring at "
            "other poses can alone appear as a drift. Compare sessions of the same poses, or find the missing physics "
            "first (`calibeam diagnose`)."
        )


def _lacks_physics(model: ModelFile) -> bool:
    """By chi-square against the noise as assumed, or by repeated poses."""
    all_of_it, repeats = scatter(model), repeated(model)
    by_spots = (model.repeats or {}).get("lack_of_fit_p")  # of the method for spots alone
    return (
        (all_of_it is not None and all_of_it.alarm is Alarm.ABOVE_STATED)
        or (repeats is not None and repeats.alarm is Alarm.LACK_OF_FIT)
        or (isinstance(by_spots, float) and by_spots < UNLIKELY)
    )


def _other_arm(now: Rig, then: Rig) -> Iterator[str]:
    ours, theirs = now.arm.serial_number, then.arm.serial_number
    if ours is not None and theirs is not None and ours != theirs:
        yield (
            f"These are two arms: serial number {ours} now, {theirs} then. What follows is how they differ, not how "
            "one of them moved."
        )
    elif now.name != then.name:
        yield f"The rig is called {now.name} now and was called {then.name} then: is it the same arm?"
