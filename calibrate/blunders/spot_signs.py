"""An axis of a detector counted the other way round: told by fits, since an arm off its drawing moves spots as far.

A face with a mirrored axis is no face that could stand anywhere, so that even the best fit misses its spots by
millimetres. Which axes they are is a comparison: every pattern of signs is fitted, and the one that is right is named.
"""

from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.columns import SPOTS
from acquisition.recording.rig_schema import Rig
from acquisition.recording.samples import Samples
from calibrate.blunders.finding import Blunder, BlunderKind
from calibrate.blunders.witness import thinned
from calibrate.dual_psd_rig import believed_noise, dual_psd_chain
from calibrate.observations import Observations
from calibrate.read_samples import observations
from calibrate.zeros.identify import fit_weighted

Floats = NDArray[np.float64]

FEWEST_POSES = 20  # four numbers each; zeros, links, mount and places are some forty unknowns
GROSS_M = 3e-4  # usual misfit: a hundred times a detector's noise; a mirrored axis leaves some 10 mm on 20 mm faces
GAIN = 4.0  # by which the misfit must fall
RIVAL = 1.5  # times the winner's misfit: as good an explanation


def mirrored_axes(rig: Rig, samples: Samples) -> Blunder | None:
    """The axes whose other sign explains the spots when those of the file do not; None if they do, or without spots."""
    if not all(name in samples for name in SPOTS):
        return None
    data = observations(samples)
    if len(data) < FEWEST_POSES:
        return None
    data = data.select(thinned(np.arange(len(data))))
    before_m = _usual_misfit_m(rig, data)
    if before_m < GROSS_M:
        return None
    patterns = [signs for signs in product((1.0, -1.0), repeat=len(SPOTS)) if min(signs) < 0.0]
    left_m = [_usual_misfit_m(rig, replace(data, spots_m=data.spots_m * np.array(signs))) for signs in patterns]
    best_m = min(left_m)
    if not before_m > GAIN * best_m:
        return None
    best, *others = (_columns(patterns[i]) for i in np.argsort(left_m) if left_m[i] < RIVAL * best_m)
    what = f"counted the other way round (spots and arm agree to {1e3 * best_m:.2g} mm then, to {1e3 * before_m:.2g} mm"
    rivals = "".join(f"; or {other}" for other in others)
    remedy = "change the sign of the column in all rows"
    return Blunder(BlunderKind.MIRRORED_AXIS, (), f"column {best}", f"{what} as written){rivals}", remedy)


def _usual_misfit_m(rig: Rig, data: Observations) -> float:
    """Median length of what the best fit leaves of two spots; infinite where no light goes that way."""
    chain = dual_psd_chain(rig, data.placement, data.first_psd)
    theta = fit_weighted(chain, data, believed_noise(rig)).fit.theta
    if not np.all(np.isfinite(theta)):
        return float("inf")
    misfit = np.linalg.norm(chain.expect(theta, data.q_rad) - data.spots_m, axis=1)
    return float(np.median(misfit)) if np.all(np.isfinite(misfit)) else float("inf")


def _columns(signs: tuple[float, ...]) -> str:
    return ", ".join(name for name, sign in zip(SPOTS, signs, strict=True) if sign < 0.0)
