"""The instruments of a recording as a model.json knows them: its rows, its frames and points, its noise, its values."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from acquisition.recording import Recording
from calibrate.errors import DataError
from calibrate.fit_plan import DEFAULT, parse_plan
from calibrate.identification.planned import rig_as_planned, samples_as_planned
from calibrate.identification.session import instruments_for_fit, standing_at
from calibrate.model_file import ModelFile
from calibrate.parameters import index_of, start_values
from calibrate.variance import VarianceFactors, as_believed
from calibrate.weighting import Measured, Weighting

Floats = NDArray[np.float64]
About = Mapping[str, tuple[float, ...]]


def weighting_of(recording: Recording, model: ModelFile) -> Weighting:
    """What was fitted: rows that no blunder names, about the frames that the corrections are about.

    DataError where recording and model do not belong together.
    """
    samples = recording.samples
    bad = {row - 1 for blunder in model.blunders for row in blunder.rows}
    kept = np.array([row for row in range(len(samples)) if row not in bad], dtype=np.intp)
    if len(bad) > len(samples) - len(kept):
        raise _strangers(recording, f"it leaves out row {max(bad) + 1}, but there are {len(samples)}")
    plan = DEFAULT if model.plan is None else parse_plan(model.plan, "fit plan in the model")
    if model.session is not None:  # a diagnosis uses second encoders without being asked to
        plan = structs.replace(plan, instruments=model.instruments)
    rig, some = rig_as_planned(recording.rig, plan), samples_as_planned(samples.take(kept), plan)
    found = standing_at(instruments_for_fit(rig, some, plan).weighting, kept)
    names = tuple(m.name for m in found.measured)
    if names != model.instruments:
        raise _strangers(recording, f"it was fitted to {', '.join(model.instruments)}, here are {', '.join(names)}")
    weighting = replace(found, measured=tuple(_placed(m, model.about) for m in found.measured))
    rows = len(np.unique(np.concatenate([m.sample_rows.ravel() for m in weighting.measured])))
    if rows != model.poses:
        raise _strangers(recording, f"it is of {model.poses} samples, here are {rows}")
    names_here = {p.name for p in weighting.parameters}
    unlike = names_here ^ set(model.chain) if model.session is None else set(model.chain) - names_here
    if unlike:
        raise _strangers(recording, f"one of them alone has the parameters {', '.join(sorted(unlike)[:4])}")
    return weighting


def values_of(weighting: Weighting, model: ModelFile) -> Floats:
    """(param,) the model's values."""
    out = start_values(weighting.parameters)
    for name, column in index_of(weighting.parameters).items():
        out[column] = model.chain.get(name, out[column])  # a diagnosis holds what it names as effects: encoder discs
    return out


def noise_of(weighting: Weighting, model: ModelFile) -> VarianceFactors:
    """Sizes of noise as the model found them, over those believed."""
    size = np.zeros(len(weighting.sources))
    for i, source in enumerate(weighting.sources):
        found, believed = model.noise.get(source), model.noise.get(f"{source}_believed")
        if isinstance(found, float) and isinstance(believed, float) and found > 0.0 and believed > 0.0:
            size[i] = 2.0 * np.log(found / believed)
    return replace(as_believed(len(size)), log_variance=size)


def _placed(measured: Measured, about: About) -> Measured:
    """The instrument with its target, device and seats where the model's corrections start from."""
    problem = measured.problem
    return replace(measured, problem=replace(problem, chain=problem.chain.placed(about)))


def _strangers(recording: Recording, why: str) -> DataError:
    return DataError(
        f"report: the model does not belong to {recording.path.name}: {why}; "
        "give the model of this recording, or identify it again"
    )
