"""Readings of a model's own recording less what its effects add: what is left is for the geometry alone."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from calibrate.diagnose.augmented import encoder_channels
from calibrate.diagnose.ported import look
from calibrate.effects.ports import Perturbation
from calibrate.model_file import ModelFile
from calibrate.physics.acting import arm_in, flange_frames
from calibrate.physics.applied import effects_at
from calibrate.predict import Predictor
from calibrate.weighting import Measured, Weighting

Floats = NDArray[np.float64]


def without_effects(weighting: Weighting, theta: Floats, samples: Samples, model: ModelFile) -> Weighting:
    """The same instruments at the values (param,) of a model, readings less what its effects add to them.

    `samples` are those of the recording that the model was made of. DataError where an effect cannot be evaluated.
    """
    if not model.effects:
        return weighting
    predictor = Predictor.of(model)
    by, q = effects_at(model, predictor, samples, same_session=True).by, samples.joints()
    arm, nothing = arm_in(predictor), Perturbation.none(len(samples), samples.n_joints)
    plain, moved = (flange_frames(arm, predictor, q, one) for one in (nothing, by))

    def less(i: int, m: Measured) -> Measured:
        own = weighting.unweighted.of_block(i, theta)
        added = look(m, own, moved).expected - look(m, own, plain).expected
        if (channels := encoder_channels(m)) is not None:
            added = added + by.between_rad[np.ix_(m.sample_rows[:, -1], channels)]
        if m.name in by.readings:
            added = added + by.readings[m.name][m.sample_rows[:, -1]]
        return replace(m, problem=replace(m.problem, observed=m.problem.observed - added))

    return replace(weighting, measured=tuple(less(i, m) for i, m in enumerate(weighting.measured)))
