"""Identification of an arm from any session: gross errors first, then rank, then numbers with their uncertainty.

A fault of the whole file (angles in degrees, a mirrored axis, ...) is refused by name; bad rows are named and left out.
docs/decisions/0003 states why rank comes before numbers and why the noise is estimated.
"""

from dataclasses import replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.files.bounds import ARM_M
from acquisition.recording.rig import Rig
from acquisition.recording.samples import POSITION
from calibrate.errors import DataError
from calibrate.fit.fit_plan import DEFAULT, FitPlan, MethodName
from calibrate.fit.gross_errors.bad_rows import duplicated_rows, left_alone, rows_beyond_limits
from calibrate.fit.identify.clean import clean, refuse_most, rows_of
from calibrate.fit.identify.evidence import EvidenceOptions, Splitting
from calibrate.fit.identify.fit_report import result_of
from calibrate.fit.identify.point_constraint import point_constraints
from calibrate.fit.identify.result import Identification
from calibrate.fit.identify.rounds import coarse_start, settled_fit
from calibrate.fit.identify.session import instruments_for_fit, rig_as_planned, samples_as_planned, standing_at
from calibrate.fit.identify.wrong_file import drawn_flange, limits_rad, refuse_wrong_file
from calibrate.fit.instruments import Instruments
from calibrate.fit.solvers.solve import Estimator
from calibrate.fit.weighting import Weighting
from calibrate.model.checks.gross_error import GrossError
from calibrate.model.checks.rough_fit import sessions_apart
from calibrate.model.checks.witness import by_target

Floats = NDArray[np.float64]


def identify(
    rig: Rig,
    samples: Samples,
    *,
    rng: Generator,
    held_out_share: float | None = None,
    bootstrap_rounds: int | None = None,
    plan: FitPlan = DEFAULT,
) -> Identification:
    """Everything about the arm that these samples determine, by all instruments whose columns they have, as the plan
    states.

    `held_out_share` of the rows, drawn by `rng`, are predicted from the others (0: no held-out proof), and
    `bootstrap_rounds` fits are made to drawn rows; None: as the plan states. DataError where there is nothing to fit,
    where the whole file is wrong, or where the plan asks for what rig or samples do not have.
    """
    rig, samples = rig_as_planned(rig, plan), samples_as_planned(samples, plan)
    weighting, start, gross_errors = without_gross_errors(rig, samples, plan)
    by = Estimator(plan.algorithm, plan.robust_loss, plan.rules)
    fitted = settled_fit(weighting, coarse_start(weighting, start), plan.of_redundant, by)
    share = plan.share if held_out_share is None else held_out_share
    rounds = plan.bootstrap if bootstrap_rounds is None else bootstrap_rounds
    asked = EvidenceOptions(Splitting(share, plan.splits), rounds)
    result = result_of(fitted, gross_errors, rig, samples, asked=asked, rng=rng)
    if plan.method is not MethodName.POINT_CONSTRAINT:
        return result
    kept = np.setdiff1d(np.arange(len(samples)), rows_of(gross_errors))
    return replace(result, point_constraints=point_constraints(rig, samples.take(kept)))


def without_gross_errors(
    rig: Rig, samples: Samples, plan: FitPlan = DEFAULT
) -> tuple[Weighting, Floats, tuple[GrossError, ...]]:
    """What can be averaged, a start for it, and what was wrong with the rows left out. DataError as of `identify`."""
    refuse_wrong_file(rig, samples)
    early = _with_left_alone(samples, (*impossible_rows(rig, samples), *_sessions_apart(rig, samples)))
    instruments = _instruments_without(rig, samples, early, plan)
    _refuse_positions(instruments)
    weighting, late = clean(instruments.weighting, coarse_start(instruments.weighting, instruments.start))
    every = _with_left_alone(samples, early + late)
    if len(every) > len(early) + len(late):
        weighting = weighting.take(np.setdiff1d(np.arange(len(samples)), rows_of(every)))
    return weighting, instruments.start, every


def _refuse_positions(instruments: Instruments) -> None:
    """DataError where positions, too few for `wrong_file`, are in millimetres or fit only as their mirror image."""
    if (found := instruments.alignment) is None:
        return
    if found.rms_m > ARM_M:
        raise DataError(
            f"all rows, columns {', '.join(POSITION)}: arm and positions are {found.rms_m:.3g} m apart wherever the "
            "device stands: positions in millimetres; write metres (millimetres times 0.001)"
        )
    if not found.mirrored:
        return
    raise DataError(
        f"all rows, columns {', '.join(POSITION)}: only the mirror image of the positions fits the arm "
        f"({1e3 * found.mirrored_rms_m:.2g} mm, as written {1e3 * found.rms_m:.3g} mm): joints count against the rig's "
        "sense, or a column of the device is negated; correct the signs (docs/formats.md, Joint signs), or measure "
        "more poses to have the joints named"
    )


def impossible_rows(rig: Rig, samples: Samples) -> tuple[GrossError, ...]:
    """Rows that no instrument has to judge: copies, angles that the arm cannot have, and what shows nothing without."""
    return _with_left_alone(samples, duplicated_rows(samples) + rows_beyond_limits(samples, limits_rad(rig)))


def _with_left_alone(samples: Samples, gross_errors: tuple[GrossError, ...]) -> tuple[GrossError, ...]:
    return gross_errors + left_alone(samples, gross_errors)


def _sessions_apart(rig: Rig, samples: Samples) -> tuple[GrossError, ...]:
    if POSITION[0] not in samples:
        return ()
    rows, positions = _positions(samples)
    flange = drawn_flange(rig)(samples.joints()[rows])
    return tuple(
        gross_error
        for theirs, point in by_target(rig, samples, rows)
        for own in [np.searchsorted(rows, theirs)]
        for gross_error in sessions_apart(flange[own], positions[own], point, theirs)
    )


def _instruments_without(
    rig: Rig, samples: Samples, gross_errors: tuple[GrossError, ...], plan: FitPlan
) -> Instruments:
    """The instruments without the rows of these gross errors; their rows count in the samples as given."""
    if not gross_errors:
        return instruments_for_fit(rig, samples, plan)
    refuse_most(gross_errors, len(samples))
    kept = np.setdiff1d(np.arange(len(samples)), rows_of(gross_errors))
    found = instruments_for_fit(rig, samples.take(kept), plan)
    return replace(found, weighting=standing_at(found.weighting, kept))


def _positions(samples: Samples) -> tuple[NDArray[np.intp], Floats]:
    """Rows that hold a position, and the positions (row, 3)."""
    positions = np.stack([samples.column(c) for c in POSITION], axis=1)
    rows = np.flatnonzero(np.isfinite(positions[:, 0]))
    return rows, positions[rows]
