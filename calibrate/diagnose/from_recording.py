"""From the samples of a recording to a diagnosis, by whatever instruments they hold: blunders, fit, physics.

Scatter far beyond what a tracker is believed to have: no noise of it, whatever statistics make of it.
A session whose rows all scatter alike looks like a noisy instrument. Beliefs of rig files are wrong by up to eight
times (mismatch study, lesson 14 of its second set), seldom by more, and a tracker's noise is certified.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from calibrate.blunders.finding import Blunder, BlunderKind
from calibrate.diagnose.blunders_first import Cleared, blunders_first
from calibrate.diagnose.diagnose import diagnose
from calibrate.diagnose.diagnosis import Diagnosis, Unexplained, Verdict
from calibrate.diagnose.fitted import Fitted, fit_geometry
from calibrate.diagnose.free_space_change import FreeSpaceChange, free_space_change
from calibrate.diagnose.session import Session, session_of
from calibrate.diagnose.stages import DECIDING, Incomplete, Stage, Stages
from calibrate.diagnose.tail import LEAST
from calibrate.diagnose.wild_rows import unexplained_rows
from calibrate.effects.catalogue import missing_of
from calibrate.effects.term import Missing
from calibrate.errors import DataError
from calibrate.identification.session import believed_sigma, columns_of
from calibrate.sensors.catalogue import kind_of
from calibrate.sensors.encoder_difference import NAME as ENCODER_DIFFERENCE
from calibrate.sensors.kind import Trait
from calibrate.weighting import Measured

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

FEWEST = 20  # samples: below, no term can be told from noise, whatever it is

BELIEVED = 10.0  # times the noise believed: beyond, it is something else
LENGTHS = 3  # components that are no turns
HIDDEN = ("cmd_minus_q", "approach", "qd", "payload")  # drivers that make poses scatter when they are not recorded


@dataclass(frozen=True, eq=False)
class Physics:
    """A diagnosis with both fits behind it."""

    diagnosis: Diagnosis
    geometry: Fitted  # alone
    model: Fitted  # with the terms of the findings
    free_space: FreeSpaceChange | None


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """`physics` is None where the whole file is wrong, or geometry could not be fitted: nothing was sought then."""

    cleared: Cleared
    blunders: tuple[Blunder, ...]  # of the file, and rows that no model explains
    physics: Physics | None
    incomplete: tuple[Incomplete, ...] = ()  # stages without a result, where there is no physics


def diagnose_samples(
    rig: Rig,
    samples: Samples,
    rng: Generator,
    begin: Callable[[Session], Fitted] = fit_geometry,
    known: Callable[[Diagnosed], None] | None = None,
) -> Diagnosed:
    """`begin`: the fit beside which something is sought, geometry alone or what a model knows already. `known` is
    called once as soon as the causes are known, before sizes, alternatives and proofs.

    DataError where there is too little to diagnose.
    """
    stages = Stages()
    every = Cleared(samples, np.arange(len(samples)), ())
    cleared = stages.attempt(Stage.FAULTS, lambda: blunders_first(rig, samples), every, refuses=True)
    if cleared.whole_file:
        return Diagnosed(cleared, cleared.blunders, None)
    if len(cleared.rows) < FEWEST:
        raise DataError(
            f"{len(cleared.rows)} samples are left to diagnose, fewer than {FEWEST}: no cause can be separated from "
            "noise; "
            "measure more poses"
        )
    geometry = stages.attempt(Stage.GEOMETRY, lambda: begin(session_of(rig, cleared.samples)), None, refuses=True)
    if geometry is None:
        return Diagnosed(cleared, cleared.blunders, None, stages.failed)

    def causes(found: Diagnosis) -> None:
        if known is not None:
            known(Diagnosed(cleared, cleared.blunders, Physics(found, geometry, _fitted(found), None)))

    diagnosis = diagnose(geometry, rng, missing_of(geometry.drivers), stages, causes)
    model = geometry if not diagnosis.findings else _fitted(diagnosis)
    attempt = stages.attempt
    diagnosis = attempt(Stage.BEYOND_NOISE, lambda: _with_scatter(diagnosis, model), diagnosis)
    change = attempt(Stage.FREE_SPACE, lambda: _free_space_change(geometry, model, rng), None)
    left = attempt(Stage.FAR_ROWS, lambda: _left(model, cleared), ())
    physics = Physics(unfinished(diagnosis, stages.failed), geometry, model, change)
    return Diagnosed(cleared, cleared.blunders + left, physics)


def unfinished(diagnosis: Diagnosis, failed: tuple[Incomplete, ...]) -> Diagnosis:
    """With the stages that have no result; a session that was not looked at to the end is not consistent."""
    open_ = diagnosis.verdict is Verdict.CONSISTENT and any(one.stage in DECIDING for one in failed)
    return replace(diagnosis, incomplete=failed, verdict=Verdict.UNDECIDABLE if open_ else diagnosis.verdict)


def _free_space_change(geometry: Fitted, model: Fitted, rng: Generator) -> FreeSpaceChange | None:
    return None if geometry.problem.given else free_space_change(geometry, model, rng)


def _with_scatter(diagnosis: Diagnosis, model: Fitted) -> Diagnosis:
    """Readings that scatter beyond belief are left without a name, and no session with them is consistent."""
    found = None if diagnosis.unexplained else beyond_noise(model, diagnosis.missing)
    if found is None:
        return diagnosis
    verdict = Verdict.UNDECIDABLE if diagnosis.verdict is Verdict.CONSISTENT else diagnosis.verdict
    return replace(diagnosis, unexplained=(found,), verdict=verdict)


def _fitted(diagnosis: Diagnosis) -> Fitted:
    if not isinstance(diagnosis.model, Fitted):
        raise TypeError(f"a diagnosis of {type(diagnosis.model).__name__}, which is no fit to a recording")
    return diagnosis.model


def _left(model: Fitted, cleared: Cleared) -> tuple[Blunder, ...]:
    """Rows that stay far off after all physics: they had next to no weight."""
    by_name = {m.name: m for m in model.session.measured}
    out: list[Blunder] = []
    for unseen in model.held_out(model.active):
        if unseen.instrument == ENCODER_DIFFERENCE:
            continue
        for i in unexplained_rows(unseen.whitened):
            away_m = float(np.linalg.norm(unseen.misfit[i, :3]))
            sigmas = float(np.linalg.norm(unseen.whitened[i]))
            out.append(_far(by_name[unseen.instrument], int(cleared.rows[unseen.sample[i]]), away_m, sigmas))
    return tuple(out)


def _far(measured: Measured, row: int, away_m: float, sigmas: float) -> Blunder:
    what = f"{1e6 * away_m:.3g} µm away from what all other rows predict ({sigmas:.0f} sigma), also after all physics"
    return Blunder(
        BlunderKind.BAD_SHOT, (row,), ", ".join(columns_of(measured)), what, "measure it again, or remove it"
    )


def beyond_noise(model: Fitted, missing: Sequence[Missing]) -> Unexplained | None:
    """What a tracker's positions scatter after all physics; None where it may be the noise that is believed."""
    session = model.session
    believed = session.rig.noise
    if believed.position_m is None or believed.joint_rad is not None:
        return None  # where joints are said to scatter, too, the fit has found how much of it is theirs
    whole, rows_of = model.noise.whole(model.problem.rows), model.problem.rows
    for measured, scatter, rows in zip(session.measured, whole, rows_of, strict=True):
        if Trait.CERTIFIED not in kind_of(measured.name).traits or len(rows) == 0:
            continue
        stated = float(np.sqrt(np.mean(believed_sigma(measured)[rows][:, :LENGTHS] ** 2)))
        found = np.diagonal(scatter.covariance, axis1=1, axis2=2)[:, :LENGTHS]
        times = float(np.sqrt(np.median(np.mean(found, axis=1)))) / max(stated, 1e-300)
        if times > BELIEVED:
            return _untold(times, [m for m in missing if m.driver in HIDDEN])
    return None


def _untold(times: float, lacking: Sequence[Missing]) -> Unexplained:
    columns = ", ".join(dict.fromkeys(m.column for m in lacking))
    why = f"positions scatter {times:.0f} times the assumed noise of the device, and no recorded column explains it"
    why += f"; missing column: {columns}" if columns else ""
    return Unexplained("", tuple(dict.fromkeys(m.driver for m in lacking)), 1.0 - 1.0 / times**2, LEAST, why)
