"""Identification of an arm from any session: blunders first, then rank, then numbers with their doubt.

A fault of the whole file (angles in degrees, a mirrored axis, ...) is refused by name; bad rows are named and left out.
docs/decisions/0003 says why rank comes before numbers and why the noise is estimated.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording.columns import POSITION
from acquisition.recording.rig_schema import Rig
from acquisition.recording.samples import Samples
from calibrate.arms.catalogue import arm_of
from calibrate.blunders.conventions import wrong_convention
from calibrate.blunders.degrees import beyond_limits
from calibrate.blunders.duplicates import duplicated_rows
from calibrate.blunders.finding import Blunder
from calibrate.blunders.other_session import sessions_apart
from calibrate.errors import DataError
from calibrate.identification.clean import clean, refuse_most, rows_of
from calibrate.identification.fit_report import result_of
from calibrate.identification.result import Identification
from calibrate.identification.rounds import settled_fit
from calibrate.identification.session import instruments_for_fit, standing_at
from calibrate.instruments import Instruments
from calibrate.parameters import start_values
from calibrate.redundant import Redundant

Floats = NDArray[np.float64]


def identify(
    rig: Rig,
    samples: Samples,
    *,
    rng: Generator,
    held_out_share: float = 0.2,
    redundant: Redundant = Redundant.REMOVED,
) -> Identification:
    """Everything about the arm that these samples tell, by all instruments whose columns they have.

    `held_out_share` of the rows, drawn by `rng`, are predicted from the others (0: no held-out proof). DataError where
    there is nothing to fit, or where the whole file is wrong.
    """
    refuse_wrong_file(rig, samples)
    early = (*duplicated_rows(samples), *_sessions_apart(rig, samples))
    instruments = _instruments_without(rig, samples, early)
    weighting, late = clean(instruments.weighting, instruments.start)
    fitted = settled_fit(weighting, instruments.start, redundant)
    repeat = samples.integers("repeat", -1) if "repeat" in samples else None
    return result_of(fitted, early + late, repeat, rng=rng, held_out_share=held_out_share)


def refuse_wrong_file(rig: Rig, samples: Samples) -> None:
    """DataError that says which convention the file is written by, where it is not that of the rig."""
    limits = np.array([[j.lower_rad, j.upper_rad] for j in rig.arm.joints])
    blunder = beyond_limits(samples.joints(), limits)
    if blunder is None and POSITION[0] in samples:
        rows, positions = _positions(samples)
        blunder = wrong_convention(_drawn_flange(rig), samples.joints()[rows], positions, _point(rig))
    if blunder is not None:
        raise DataError(blunder.says)


def _sessions_apart(rig: Rig, samples: Samples) -> tuple[Blunder, ...]:
    if POSITION[0] not in samples:
        return ()
    rows, positions = _positions(samples)
    return sessions_apart(_drawn_flange(rig)(samples.joints()[rows]), positions, _point(rig), rows)


def _instruments_without(rig: Rig, samples: Samples, blunders: tuple[Blunder, ...]) -> Instruments:
    """The instruments without the rows of these blunders; their rows count in the samples as given."""
    if not blunders:
        return instruments_for_fit(rig, samples)
    refuse_most(blunders, len(samples))
    kept = np.setdiff1d(np.arange(len(samples)), rows_of(blunders))
    found = instruments_for_fit(rig, samples.take(kept))
    return replace(found, weighting=standing_at(found.weighting, kept))


def _positions(samples: Samples) -> tuple[NDArray[np.intp], Floats]:
    """Rows that hold a position, and the positions (row, 3)."""
    positions = np.stack([samples.column(c) for c in POSITION], axis=1)
    rows = np.flatnonzero(np.isfinite(positions[:, 0]))
    return rows, positions[rows]


def _point(rig: Rig) -> Floats | None:
    return None if rig.tool.point_m is None else np.array(rig.tool.point_m)


def _drawn_flange(rig: Rig) -> Callable[[Floats], Floats]:
    """Angles (pose, joint) to (pose, 4, 4) of the arm as drawn."""
    arm = arm_of(rig)
    return lambda q_rad: arm.flange(start_values(arm.parameters), q_rad)
