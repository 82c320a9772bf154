"""What a search explains of the difference of two recordings, and what it leaves."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording
from calibrate.compare.chain import (
    Pair,
    of_rig,
)
from calibrate.compare.comparison_file import Level, Mismatch, ReadingRecord
from calibrate.compare.corrected import compared_session, corrected_samples, simulated_of
from calibrate.compare.fit_to_simulation import (
    SimulationFit,
    begin,
    fit_to_simulation,
    fit_to_structure,
    set_alike,
)
from calibrate.compare.link_differs import (
    ALARM,
    ROUNDING,
    chance_of_structure,
)
from calibrate.diagnose.record.schema import DiagnosisFile
from calibrate.diagnose.record.to_file import file_of
from calibrate.diagnose.state import Fitted
from calibrate.errors import DataError
from calibrate.model.model_file import ModelFile
from calibrate.model.predict import Predictor
from calibrate.model.sensors.catalogue import kind_of

Floats = NDArray[np.float64]
SEED = 1  # of nulls, splits and bootstraps: the same pair always gives the same comparison
FEWEST = 20  # samples of a search; fewer hold no more than the geometry


@dataclass(frozen=True, eq=False)
class Explanation:
    """What a search gave; `beside` None: it was not made, and `why` has the reason."""

    found: SimulationFit | None
    readings: tuple[ReadingRecord, ...]
    diagnosis: DiagnosisFile | None
    left: tuple[Mismatch, ...]  # structure of the readings that remains and that no search has named
    why: str | None


def explain(
    measured: Recording,
    simulated: Recording,
    pair: Pair,
    zeros_rad: Floats,
    made_of: ModelFile | None,
    *,
    diagnosed: bool,
) -> tuple[Explanation, Predictor, Pair]:
    """What a search gives, the simulation's geometry, and the pair as if set up alike."""
    same = _same(pair)
    try:
        simulation = simulated_of(simulated.rig, pair[1])
        here = simulation.model
        alike = pair if same else set_alike(simulation, pair)
    except (DataError, np.linalg.LinAlgError) as why:
        return Explanation(None, (), None, (), f"no reading to compare: {why}"), of_rig(simulated.rig), pair
    if not diagnosed or same:
        return Explanation(None, (), None, (), None), here, alike
    if len(pair[0]) < FEWEST:
        why = f"{len(pair[0])} samples are too few to explain a difference; {FEWEST} are needed"
        return Explanation(None, (), None, (), why), here, alike
    differing = [f"joint{j + 1}.zero" for j in np.flatnonzero(zeros_rad)]
    try:
        rng = np.random.default_rng(SEED)
        if made_of is None or made_of.covariance is None or differing:
            found = fit_to_simulation(simulation, pair, rng, differing)
        else:
            found = fit_to_structure(simulation, pair, rng, made_of)
        samples = corrected_samples(simulation, pair, found.T_simulated_measured)
        before = begin(simulation, compared_session(simulated.rig, samples))
    except (DataError, np.linalg.LinAlgError) as why:
        return Explanation(None, (), None, (), f"the difference could not be explained: {why}"), here, alike
    if found.diagnosed.physics is None:
        why = f"the difference could not be explained: {found.diagnosed.why_not}"
        return Explanation(None, (), None, (), why), here, alike
    source = replace(measured, rig=simulated.rig, rig_text=simulated.rig_text, streams={}, events=())
    file = file_of(found.diagnosed, source)
    after = found.diagnosed.physics.model
    return Explanation(found, tuple(_readings(before, after, file)), file, tuple(_left(after)), None), here, alike


def _same(pair: Pair) -> bool:
    """Whether both are one recording: what a fit of their difference leaves is rounding, in which much can be seen."""
    one, other = pair
    if one.columns.keys() != other.columns.keys():
        return False
    return all(_same_column(values, other.columns[name]) for name, values in one.columns.items())


def _same_column(one: NDArray[Any], other: NDArray[Any]) -> bool:
    if one.dtype.kind == other.dtype.kind == "f":
        return np.allclose(one, other, rtol=0.0, atol=ROUNDING, equal_nan=True)
    return np.array_equal(one, other)


def notes_of(asked: Explanation) -> Iterator[str]:
    """What was not compared, and why."""
    if asked.why is not None:
        yield asked.why
    if asked.found is not None:
        for name in asked.found.simulated.uncorrected:
            yield f"{kind_of(name).noun}: what the simulation's own readings miss its geometry by is not taken out"
        for part in asked.found.blind:
            joint = part.where.removesuffix(".angle").removeprefix("joint")
            yield f"the target lies on the axis of joint {joint}: whether its zero differs cannot be determined"


def _readings(before: Fitted, after: Fitted, file: DiagnosisFile) -> Iterator[ReadingRecord]:
    """Of every quantity of an instrument, a 6-D target's position and turn apart."""
    one = {m.name: m.problem.observed - e for m, e in zip(before.session.measured, before.around.expected, strict=True)}
    floors = {f.instrument: f.rms_m for f in file.floors}
    for m, expected in zip(after.session.measured, after.around.expected, strict=True):
        for k, quantity in enumerate(kind_of(m.name).quantities):
            was, is_now = one[m.name][:, quantity.part], (m.problem.observed - expected)[:, quantity.part]
            name = f"{m.name} {quantity.name}".strip()
            noise = floors.get(m.name) if k == 0 else None
            yield ReadingRecord(name, quantity.unit, m.problem.rows, _rms(was), _rms(is_now), noise)


def _rms(misfit: Floats) -> float:
    return float(np.sqrt(np.mean(misfit**2)))


def _left(after: Fitted) -> Iterator[Mismatch]:
    """What follows the order of the rows where the search has found nothing to name: less than a cause, not noise."""
    if after.noise.shared is not None:
        return
    for m, expected in zip(after.session.measured, after.around.expected, strict=True):
        misfit = m.problem.observed - expected
        p = chance_of_structure(misfit)
        if p < ALARM and float(np.max(np.abs(misfit))) > ROUNDING:
            says = (
                f"What is left of the {kind_of(m.name).noun} follows the order of the samples, and no cause explains it"
            )
            yield Mismatch(Level.UNEXPLAINED, "", "unknown", {}, says, p=p)
