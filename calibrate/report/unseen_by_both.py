"""The identified geometry and a diagnosis on the same unseen rows: which of the two models is to be kept.

A diagnosis has a geometry of its own, robust and with priors about all of it, and proves its physics against that. The
identification may be better than this geometry, so that its model is left out of the rows of the same splits, too.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from msgspec import structs
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording import Recording
from calibrate.diagnose.assess import proofs
from calibrate.diagnose.from_recording import Diagnosed
from calibrate.diagnose.record.schema import DiagnosisFile
from calibrate.diagnose.record.to_file import split_record
from calibrate.diagnose.state import UnseenMisfits
from calibrate.errors import DataError
from calibrate.fit.fit_plan import DEFAULT
from calibrate.fit.held_out import Proof, Split, held_out
from calibrate.fit.joint_problem import JointProblem
from calibrate.fit.solvers import Estimator
from calibrate.fit.weighting import Weighting
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.term import Accepted
from calibrate.model.model_file import ModelFile
from calibrate.model.problem import Problem
from calibrate.model.sensors.encoder_difference import NAME as ENCODER_DIFFERENCE
from calibrate.report.evidence import noise_of, values_of, weighting_of

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


def compared_on_unseen_rows(
    recording: Recording, identified: ModelFile, found: Diagnosed, file: DiagnosisFile, rng: Generator
) -> DiagnosisFile:
    """The file with the proofs of its physics against the identified geometry in place of the diagnosis' own.

    Samples that either has left out take no part. DataError where the two cannot be compared on the same readings.
    """
    if found.physics is None or not found.physics.model.accepted:
        raise DataError("the diagnosis has no physics to compare")
    bare, full = _Identified.of(recording, identified, found), found.physics.model
    shared = np.intersect1d(full.active, bare.samples)
    each = proofs(bare, full, shared, rng)
    if not each:
        raise DataError("the samples are too few to leave some of them out")
    return structs.replace(file, splits=tuple(map(split_record, each)))


@dataclass(frozen=True, eq=False)
class _Identified:
    """What a proof asks of a model; samples are counted as in the diagnosis."""

    weighting: Weighting
    problem: JointProblem  # free as in the fit
    theta: Floats  # (param,)
    mapped: tuple[Ints, ...]  # of each instrument (row, m): its samples, -1 of one that the diagnosis has left out
    drivers: Drivers
    wanted: tuple[str, ...]  # instruments, in the order of the diagnosis
    known: Ints  # samples that a refit sees

    @classmethod
    def of(cls, recording: Recording, model: ModelFile, found: Diagnosed) -> "_Identified":
        if found.physics is None or model.covariance is None:
            raise DataError("one of the two models has no fit to compare")
        weighting, session = weighting_of(recording, model), found.physics.model.session
        wanted = tuple(m.name for m in session.measured if m.name != ENCODER_DIFFERENCE)
        if missing := {*wanted} - {m.name for m in weighting.measured}:
            raise DataError(f"the identification does not use {', '.join(sorted(missing))}")
        theta, free = values_of(weighting, model), set(model.covariance.names)
        problem = weighting.problem(theta, noise_of(weighting, model))
        parameters = tuple(replace(p, free=p.free and p.name in free) for p in problem.parameters)
        place = np.full(len(recording.samples), -1, dtype=np.intp)
        place[found.cleared.rows] = np.arange(len(found.cleared.rows))
        mapped = tuple(place[m.sample_rows] for m in weighting.measured)
        drivers = found.physics.model.drivers
        out = cls(weighting, problem.with_parameters(parameters), theta, mapped, drivers, wanted, np.zeros(0, np.intp))
        return replace(out, known=out.samples)

    @property
    def samples(self) -> Ints:
        """(sample,) that take part in both."""
        every = np.unique(np.concatenate([rows.ravel() for rows in self.mapped]))
        return every[every >= 0]

    def select(self, samples: Ints) -> Self:
        return replace(self, known=samples)

    def refitted(self, accepted: Sequence[Accepted]) -> Self:
        """Geometry alone, which `held_out` refits."""
        return self

    def held_out(self, samples: Ints) -> tuple[UnseenMisfits, ...]:
        """Observations of these samples, by a refit to the known ones. DataError where it does not converge."""
        used, left = _all_among(self.mapped, self.known), _all_among(self.mapped, samples)
        lengths = np.zeros(self.problem.rows - sum(map(len, self.mapped)), dtype=bool)  # that the rig states: known
        unseen, seen = np.concatenate([*left, lengths]), np.concatenate([*used, ~lengths])
        kept = np.flatnonzero(unseen | seen)
        split = Split("", (np.flatnonzero(unseen[kept]),))
        by = Estimator(DEFAULT.algorithm, DEFAULT.robust_loss, DEFAULT.rules)
        found = held_out(self.problem.select(kept), split, self.theta, _misfits, by)
        if found.proof is not Proof.DONE:
            raise DataError(f"identified geometry on unseen rows: {found.proof.value}")
        misfits = self._of_each(found.errors[0], left)
        return tuple(misfits[name] for name in self.wanted if name in misfits)

    def _of_each(self, errors: Floats, left: list[NDArray[np.bool_]]) -> dict[str, UnseenMisfits]:
        out, at = dict[str, UnseenMisfits](), 0
        for m, rows, mine in zip(self.weighting.measured, self.mapped, left, strict=True):
            shape = (int(mine.sum()), m.problem.observed.shape[1])
            misfit = errors[at : at + shape[0] * shape[1]].reshape(shape)
            at += misfit.size
            if len(misfit):
                out[m.name] = UnseenMisfits(m.name, rows[mine, -1], misfit, misfit)
        return out


def _all_among(mapped: Sequence[Ints], samples: Ints) -> list[NDArray[np.bool_]]:
    """Of each instrument (row,) whether all samples of a row are among these."""
    return [np.asarray(np.isin(rows, samples).all(axis=1), dtype=np.bool_) for rows in mapped]


def _misfits(problem: JointProblem, theta: Floats) -> Floats:
    """Of every instrument, one after the other."""
    each = ((block, problem.of_block(i, theta)) for i, block in enumerate(problem.blocks))
    return np.concatenate([block.misfit(own).ravel() for block, own in each if isinstance(block, Problem)])
