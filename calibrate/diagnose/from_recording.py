"""From the samples of a recording to a diagnosis, by whatever instruments they hold: gross errors, fit, physics.

Scatter beyond the stated noise is no noise (stated_noise.py): no session with it is consistent, no name in it final.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.special import ndtr

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from calibrate.diagnose import limits
from calibrate.diagnose.assess.assessment import records
from calibrate.diagnose.assess.diagnosis import Diagnosis, Unexplained, Verdict
from calibrate.diagnose.assess.free_space_change import FreeSpaceChange, free_space_change
from calibrate.diagnose.assess.missing_columns import TIME, not_final_drift
from calibrate.diagnose.assess.stated_noise import (
    NoiseFound,
    Statement,
    hidden_of,
    missing_words,
    noise_found,
)
from calibrate.diagnose.diagnose import diagnose
from calibrate.diagnose.gross_errors import Cleared, gross_errors_first, unexplained_rows
from calibrate.diagnose.search import limits as search_limits
from calibrate.diagnose.stages import (
    DECIDING,
    Incomplete,
    Stage,
    Stages,
)
from calibrate.diagnose.state.fitted import Fitted, fit_geometry
from calibrate.diagnose.state.noise_of_fit import freedom
from calibrate.diagnose.state.session import Session, session_of
from calibrate.fit.identify.session import about_of, columns_of
from calibrate.model.checks.gross_error import GrossError, GrossErrorKind, err_alike, postures
from calibrate.model.effects.catalogue import missing_of
from calibrate.model.effects.term import Missing
from calibrate.model.problem import Measured
from calibrate.model.sensors.encoder_difference import NAME as ENCODER_DIFFERENCE

if TYPE_CHECKING:
    from calibrate.diagnose.motion import TorqueDiagnosis

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

NOT_SEPARATED = "no cause can be separated from noise; measure more poses"


@dataclass(frozen=True, eq=False)
class Physics:
    """A diagnosis with both fits behind it."""

    diagnosis: Diagnosis
    geometry: Fitted  # alone
    model: Fitted  # with the terms of the findings
    free_space: FreeSpaceChange | None


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """`physics` is None where nothing was sought: the whole file is wrong, no geometry fits, or samples are too few."""

    cleared: Cleared
    blunders: tuple[GrossError, ...]  # of the file, and rows that no model explains
    physics: Physics | None
    incomplete: tuple[Incomplete, ...] = ()  # stages without a result, where there is no physics
    torques: "TorqueDiagnosis | None" = None  # of a recording in motion

    @property
    def why_not(self) -> str:
        """Why nothing was sought, where nothing was."""
        return "; besides, ".join([*(one.says for one in self.blunders), *(one.reason for one in self.incomplete)])


def diagnose_samples(
    rig: Rig,
    samples: Samples,
    rng: Generator,
    begin: Callable[[Session], Fitted] = fit_geometry,
    known: Callable[[Diagnosed], None] | None = None,
    begun: Callable[[Stage], None] | None = None,
) -> Diagnosed:
    """`begin`: the fit beside which something is sought, geometry alone or what a model knows already. `known` is
    called once as soon as the causes are known, before sizes, alternatives and proofs; `begun` as each stage begins.

    DataError where the rows cannot be read as a session of the rig; of too few nothing is sought.
    """
    stages = Stages(begun=begun)
    every = Cleared(samples, np.arange(len(samples)), ())
    cleared = stages.attempt(Stage.FAULTS, lambda: gross_errors_first(rig, samples), every, refuses=True)
    if cleared.whole_file:
        return Diagnosed(cleared, cleared.blunders, None)
    if len(cleared.rows) < limits.FEWEST_SAMPLES:
        few = f"{len(cleared.rows)} samples are left to diagnose, fewer than {limits.FEWEST_SAMPLES}: {NOT_SEPARATED}"
        return Diagnosed(cleared, cleared.blunders, None, (Incomplete(Stage.SEARCH, few),))
    geometry = stages.attempt(Stage.GEOMETRY, lambda: begin(session_of(rig, cleared.samples)), None, refuses=True)
    if geometry is None:
        return Diagnosed(cleared, cleared.blunders, None, stages.failed)
    if wrong := _another_arm(geometry):
        return Diagnosed(cleared, (*cleared.blunders, wrong), None, stages.failed)

    def causes(found: Diagnosis) -> None:
        if known is not None:
            known(Diagnosed(cleared, cleared.blunders, Physics(found, geometry, _fitted(found), None)))

    if few := _too_few(geometry):
        return Diagnosed(cleared, cleared.blunders, None, (*stages.failed, Incomplete(Stage.SEARCH, few)))
    diagnosis = diagnose(geometry, rng, missing_of(geometry.drivers), stages, causes)
    if geometry.samples < limits.FEWEST_FOR_NAMES:
        diagnosis = replace(diagnosis, findings=tuple(map(not_final_drift, diagnosis.findings)))
    model = geometry if not diagnosis.findings else _fitted(diagnosis)
    attempt = stages.attempt
    diagnosis = attempt(Stage.BEYOND_NOISE, lambda: _with_noise(diagnosis, model, rng), diagnosis)
    change = attempt(Stage.FREE_SPACE, lambda: _free_space_change(geometry, model, rng), None)
    left, together = attempt(Stage.FAR_ROWS, lambda: _left(model, cleared), ((), ()))
    diagnosis = _with_unexplained(diagnosis, together)
    physics = Physics(unfinished(diagnosis, stages.failed), geometry, model, change)
    return Diagnosed(cleared, cleared.blunders + left, physics)


def _too_few(geometry: Fitted) -> str:
    """Why no cause is sought, where few samples leave next to nothing beside the geometry; else nothing."""
    if geometry.samples >= limits.FEWEST_FOR_NAMES:
        return ""
    each = zip(geometry.session.measured, geometry.problem.rows, strict=True)
    numbers = [len(rows) * m.problem.observed.shape[1] for m, rows in each]
    left = float(np.sum(numbers / freedom(geometry.problem, geometry.values, geometry.covariance)))
    few = f"{geometry.samples} samples leave {left:.0f} numbers beside the geometry, fewer than {limits.FEWEST_LEFT}"
    return f"{few}: {NOT_SEPARATED}" if left < limits.FEWEST_LEFT else ""


def _another_arm(geometry: Fitted) -> GrossError | None:
    """Where the fitted arm stays far beside the readings: no physics moves an arm so, and what would be named is none.

    Of readings that are lengths before the arm; spots on a detector are smaller than that, whatever is wrong.
    """
    reach_m = _reach_m(geometry)
    for unseen in geometry.held_out(geometry.active):
        away_m = float(np.median(np.linalg.norm(unseen.misfit[:, :3], axis=1)))
        if unseen.instrument != ENCODER_DIFFERENCE and away_m > limits.FAR_OF_REACH * reach_m:
            what = (
                f"{1e3 * away_m:.3g} mm beside {unseen.instrument} whatever zeros, lengths, base and tool are, "
                f"{100.0 * away_m / reach_m:.2g} % of a reach of {reach_m:.2g} m: no arm of this table"
            )
            remedy = "check the table, the order and signs of the joints, the units, and whether rows belong together"
            return GrossError(GrossErrorKind.ANOTHER_ARM, (), "rig file, arm", what, remedy)
    return None


def _reach_m(geometry: Fitted) -> float:
    """From the base to the farthest that the flange, or a point on it that is measured, came from there.

    A single joint, or a wrist, reaches by its tool alone.
    """
    base, flange = geometry.around.frames[:, 0], geometry.around.frames[:, -1]
    own_m = np.stack([np.zeros(3), *_points_m(geometry)])
    points = np.einsum("nij,kj->nki", flange[:, :3, :3], own_m) + flange[:, None, :3, 3]
    return float(np.max(np.linalg.norm(points - base[:, None, :3, 3], axis=2)))


def _points_m(geometry: Fitted) -> list[Floats]:
    """(3,) each in the flange: laser, tool and targets, where the fit has put them."""
    rig, about = geometry.session.rig, about_of(geometry.session.weighting)
    values = {p.name: v for p, v in zip(geometry.session.parameters, geometry.geometry.tolist(), strict=True)}
    drawn = {"tool": rig.tool.point_m} | {f"target{k}": target.point_m for k, target in rig.targets.items()}
    stated = {name: about.get(name, point_m) for name, point_m in drawn.items()}
    found = [
        np.array(point_m[:3]) + [values.get(f"{name}.{axis}", 0.0) for axis in "xyz"]
        for name, point_m in stated.items()
        if point_m is not None
    ]
    return found if rig.tool.laser_origin_m is None else [*found, np.array(rig.tool.laser_origin_m)]


def unfinished(diagnosis: Diagnosis, failed: tuple[Incomplete, ...]) -> Diagnosis:
    """With the stages that have no result; a session that was not looked at to the end is not consistent."""
    open_ = diagnosis.verdict is Verdict.CONSISTENT and any(one.stage in DECIDING for one in failed)
    return replace(diagnosis, incomplete=failed, verdict=Verdict.UNDECIDABLE if open_ else diagnosis.verdict)


def _free_space_change(geometry: Fitted, model: Fitted, rng: Generator) -> FreeSpaceChange | None:
    return None if geometry.problem.given else free_space_change(geometry, model, rng)


def _with_noise(diagnosis: Diagnosis, model: Fitted, rng: Generator) -> Diagnosis:
    """Beside the stated noise. What exceeds it is left without a name, no session with it is consistent, no name in it
    is more likely than not, and the columns that could explain it come first among what to do.
    """
    named = {finding.name.where for finding in diagnosis.findings}  # a drift without its thermometer leaves nothing
    unnamed = any(left.where not in named for left in diagnosis.unexplained)
    noise = noise_found(model, rng, unnamed=unnamed)
    more = tuple(beyond_noise(n, diagnosis.missing) for n in noise if n.statement is Statement.EXCEEDED)
    if not more:
        return replace(diagnosis, noise=noise)
    first = () if diagnosis.unexplained else records(hidden_of(diagnosis.missing))
    findings, then = tuple(map(not_final_drift, diagnosis.findings)), tuple(dict.fromkeys((*first, *diagnosis.next)))
    return _with_unexplained(replace(diagnosis, noise=noise, findings=findings, next=then), more)


def _fitted(diagnosis: Diagnosis) -> Fitted:
    if not isinstance(diagnosis.model, Fitted):
        raise TypeError(f"a diagnosis of {type(diagnosis.model).__name__}, which is no fit to a recording")
    return diagnosis.model


def _with_unexplained(diagnosis: Diagnosis, more: tuple[Unexplained, ...]) -> Diagnosis:
    """What has structure without a name is never consistent."""
    if not more:
        return diagnosis
    verdict = Verdict.UNDECIDABLE if diagnosis.verdict is Verdict.CONSISTENT else diagnosis.verdict
    return replace(diagnosis, unexplained=(*diagnosis.unexplained, *more), verdict=verdict)


def _left(model: Fitted, cleared: Cleared) -> tuple[tuple[GrossError, ...], tuple[Unexplained, ...]]:
    """Rows that stay far off after all physics: they had next to no weight. Then those that err one after another."""
    by_name = {m.name: m for m in model.session.measured}
    out: list[GrossError] = []
    together: list[Unexplained] = []
    for unseen in model.held_out(model.active):
        if unseen.instrument == ENCODER_DIFFERENCE:
            continue
        far = unexplained_rows(unseen.whitened)
        posture = postures(model.session.samples.joints()[unseen.sample])
        far = far[~err_alike(unseen.whitened, posture, far)]
        for i in far:
            away_m = float(np.linalg.norm(unseen.misfit[i, :3]))
            sigmas = float(np.linalg.norm(unseen.whitened[i]))
            out.append(_far(by_name[unseen.instrument], int(cleared.rows[unseen.sample[i]]), away_m, sigmas))
        power = np.sum(unseen.whitened**2, axis=1)
        for run, p in runs_of(unseen.sample[far], len(unseen.sample)):
            share = float(power[np.isin(unseen.sample, run)].sum() / power.sum())
            together.append(_together(cleared.rows[run], share, p))
    return tuple(out), tuple(together)


def runs_of(far: Ints, samples: int) -> list[tuple[Ints, float]]:
    """Of samples that err (far,) those that follow each other without one between, and how likely chance has such runs.

    As many errors that hit samples independently have no more than n (k/n)^r runs of r on average, k errors among n
    (Feller, An introduction to probability theory, vol. 1, 3rd ed. 1968, XIII.7, first term); kept below RUN_ALPHA.
    """
    runs = np.split(np.unique(far), np.flatnonzero(np.diff(np.unique(far)) > 1) + 1)
    each = [(run, samples * (len(far) / samples) ** len(run)) for run in runs if len(run) >= limits.FEWEST_IN_A_RUN]
    return [(run, max(p, search_limits.LEAST_P)) for run, p in each if p < limits.RUN_ALPHA]


def _together(rows: Ints, share: float, p: float) -> Unexplained:
    why = (
        f"rows {rows[0] + 1} to {rows[-1] + 1}, one after another, are far from what all other rows predict: no gross "
        "errors of single readings. Something stood elsewhere for that time (fixture, target, instrument, base), or "
        "was disturbed; measure these poses again"
    )
    return Unexplained("", (TIME,), share, p, why)


def _far(measured: Measured, row: int, away_m: float, sigmas: float) -> GrossError:
    what = f"{1e6 * away_m:.3g} µm away from what all other rows predict ({sigmas:.0f} sigma), also after all physics"
    return GrossError(
        GrossErrorKind.BAD_SHOT, (row,), ", ".join(columns_of(measured)), what, "measure it again, or remove it"
    )


def beyond_noise(found: NoiseFound, missing: Sequence[Missing]) -> Unexplained:
    """What is left beyond a stated noise, as structure without a name."""
    times, sigma = found.times or 1.0, found.times_sigma or 0.0
    lacking = hidden_of(missing)
    p = float(ndtr((1.0 - times**2) / max(2.0 * times * sigma, 1e-300)))
    drivers = tuple(dict.fromkeys(m.driver for m in lacking))
    return Unexplained(
        "", drivers, 1.0 - 1.0 / times**2, max(p, search_limits.LEAST_P), found.says + missing_words(missing)
    )
