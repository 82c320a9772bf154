"""A dual-PSD session around its joint zeros: blunders found before them, proofs made after them.

Blunders: the whole file, copies, and rows no light explains. Proofs are those of every other session.
"""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording.rig_schema import Rig
from acquisition.recording.samples import Samples
from calibrate.arms.catalogue import arm_of
from calibrate.blunders.finding import Blunder
from calibrate.blunders.shots import robust_scale
from calibrate.default_belief import links_of
from calibrate.dual_psd_rig import believed_noise, dual_psd_chain
from calibrate.identification.clean import clean, refuse_most, rows_of
from calibrate.identification.evidence import Asked
from calibrate.identification.fit_report import result_of
from calibrate.identification.identify import impossible_rows, refuse_wrong_file
from calibrate.identification.result import Identification
from calibrate.identification.rounds import distances, settled_fit
from calibrate.identification.session import standing_at
from calibrate.instruments import instruments_of
from calibrate.parameters import index_of
from calibrate.read_samples import observations
from calibrate.zeros.identify import fit_weighted
from calibrate.zeros.result import ZeroResult

Floats = NDArray[np.float64]

SUSPICIOUS = 7.0  # robust sigmas of the farthest row in a fit of all rows: below, none can be bad enough to be named


def without_blunders(rig: Rig, samples: Samples) -> tuple[Samples, tuple[Blunder, ...]]:
    """The samples that can be fitted, and what was wrong with the rows left out (counted in the samples as given).

    DataError where the whole file is wrong, or where it holds no spots.
    """
    refuse_wrong_file(rig, samples)
    copies = impossible_rows(rig, samples)
    refuse_most(copies, len(samples))
    kept = np.setdiff1d(np.arange(len(samples)), rows_of(copies))
    late = _bad_spots(rig, samples.take(kept), kept)
    kept = np.setdiff1d(kept, rows_of(late))
    return (samples.take(kept) if copies or late else samples), copies + late


def proved(rig: Rig, samples: Samples, zeros: ZeroResult, *, asked: Asked, rng: Generator) -> Identification:
    """The fit behind these zeros once more, by the way of all instruments, for what is proved of it."""
    weighting = instruments_of(samples, rig, arm=arm_of(rig, links_of(rig))).weighting
    index = index_of(zeros.parameters)
    fitted = settled_fit(weighting, np.array([zeros.theta[index[p.name]] for p in weighting.parameters]))
    return result_of(fitted, (), rig, samples, asked=asked, rng=rng)


def _bad_spots(rig: Rig, samples: Samples, rows: NDArray[np.intp]) -> tuple[Blunder, ...]:
    """`rows` say where these samples stand in the file."""
    data = observations(samples)
    fit = fit_weighted(dual_psd_chain(rig, data.placement, data.first_psd), data, believed_noise(rig)).fit
    if not np.all(np.isfinite(fit.theta)):
        return ()
    found = instruments_of(samples, rig, arm=arm_of(rig, links_of(rig)))
    index = index_of(fit.parameters)
    start = np.array([fit.theta[index[p.name]] for p in found.weighting.parameters])
    factors = found.weighting.noise(fit.parameters, start)
    (distance, *_) = distances(found.weighting.problem(start, factors), start)
    if np.max(distance) < SUSPICIOUS * robust_scale(distance, data.spots_m.shape[1]):
        return ()
    return clean(standing_at(found.weighting, rows), start)[1]
