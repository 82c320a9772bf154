"""The measured recording asked beside the simulation: which constants of its geometry differ, and which physics.

The simulation's geometry is held as fitted to its own readings (calibrate/compare/corrected.py). What is set
up again for every recording, the measuring device and the zeros of second encoders, is fitted. Zeros of joints, links,
tool and stations compete with the whole catalogue of effects in one search, so a soft joint is not taken for a zero,
and one test prices all of them (calibrate/diagnose/search/searching.py).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from acquisition.recording import Samples
from acquisition.recording.samples import ORIENTATION, POSITION
from calibrate.compare.chain import Pair, columns_of
from calibrate.compare.constants import (
    AXES,
    TURNS,
    Part,
    Quadratic,
    alternatives,
    blind_zeros,
    fewest,
    outermost,
    parts_of,
    undetected,
)
from calibrate.compare.corrected import (
    Simulated,
    compared_session,
    corrected_samples,
    of_both,
    predictor_of,
    without_known,
)
from calibrate.diagnose.assess import Named
from calibrate.diagnose.from_recording import Diagnosed, diagnose_samples
from calibrate.diagnose.search import Bench, sandwich
from calibrate.diagnose.state import Assumed, Fitted, Session, fit_geometry
from calibrate.diagnose.with_model import ANEW, Known
from calibrate.errors import DataError
from calibrate.fit.identify.session import about_of
from calibrate.model.effects.moved import RECORDING, SIX
from calibrate.model.effects.term import Size, Term
from calibrate.model.model_file import ModelFile
from calibrate.model.parameters import Parameter, plausible_sizes, start_values
from calibrate.model.placement import TARGETS
from calibrate.model.predict import Predictor, predict
from calibrate.model.rigid import inverse
from calibrate.model.sensors import seat, wire

Floats = NDArray[np.float64]

WIDE = 3.0  # plausible sizes: one sigma of a constant that may differ; no opinion, but no other arm either
ROUNDS = 4  # of searches; usually the first one is the last
SURE = 1e-3  # chance of a constant by noise alone, beside the effects found
SET_UP = 1e-3  # chance of a device's difference by noise alone, below which it stands elsewhere
NO_VALUES = np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros((0, 0))
NOTHING = Assumed(*NO_VALUES, of_difference=True)  # the values are held, not assumed


@dataclass(frozen=True)
class Constant:
    """Numbers of the geometry that differ, all of one part; `sizes` are measured less simulated."""

    where: str  # the port
    physics: str
    names: tuple[str, ...]  # parameters of the model
    sizes: tuple[Size, ...]
    p: float  # of such numbers by noise alone
    rivals: tuple[Named, ...]


@dataclass(frozen=True, eq=False)
class SimulationFit:
    """What was found of the measured recording beside the simulation. `diagnosed.physics` None: the file is wrong."""

    simulated: Simulated
    diagnosed: Diagnosed  # under the constants found: its own findings are effects, and changes that are no parameter
    constants: tuple[Constant, ...]
    device: Constant | None  # None: no device, or it stands where it stood
    T_simulated_measured: Floats  # (4, 4) the measuring device of the one recording in that of the other
    blind: tuple[Part, ...] = ()  # zeros that these readings do not show
    dropped: tuple[Constant, ...] = ()  # not worth their numbers: as in the simulation, to within these sizes
    wide: Fitted | None = None  # the model with those free, too: what every size and sigma is taken from


def fit_to_simulation(simulated: Simulated, pair: Pair, rng: Generator, differing: Sequence[str] = ()) -> SimulationFit:
    """DataError where there is too little to compare. `differing`: parameters that are known to differ.

    Constants first, all at once; then every effect of the catalogue beside those that are worth their numbers. What an
    effect explains better is no constant: it is held again, and the search is made again.
    """
    T = device_between(simulated, pair)
    samples = corrected_samples(simulated, pair, T)
    session = compared_session(simulated.rig, samples)
    every = parts_of(session.parameters)
    whole = begin(simulated, session, frozenset(name for part in every for name in part.names))
    if blind := tuple(p for p in blind_zeros(whole, every) if not set(p.names) & set(differing)):
        every = tuple(part for part in every if part not in blind)
        whole = begin(simulated, session, frozenset(name for part in every for name in part.names))
    quadratic = Quadratic.of(whole, _values(simulated, session), every)
    sure = tuple(part for part in every if set(part.names) & set(differing))
    freed = _worth(simulated, session, tuple(dict.fromkeys((*sure, *outermost(quadratic, fewest(quadratic))))), sure)
    found = _asked(simulated, samples, rng, freed)
    for _ in range(ROUNDS):
        if found.physics is None:
            return SimulationFit(simulated, found, (), None, T, blind)
        kept = _still(simulated, found.physics.model, freed, sure)
        more = tuple(part for part in _named_constants(found, every) if part not in kept)
        if kept == freed and not more:
            break
        freed = (*kept, *more)
        found = _asked(simulated, samples, rng, freed)
    if found.physics is None:
        return SimulationFit(simulated, found, (), None, T, blind)
    others, back = alternatives(quadratic, freed), undetected(quadratic, freed)
    limits = {name: float(x) for part, off in back.items() for name, x in zip(part.names, off, strict=True)}
    model = _with_free(simulated, found.physics.model, limits)
    covariance = _covariance(model)
    constants = tuple(_constant(simulated, model, covariance, part, others[part]) for part in freed)
    dropped = tuple(_constant(simulated, model, covariance, part) for part in back)
    at, here = device_of(predictor_of(model.session, model.geometry)), device_of(simulated.model)
    if at is None or here is None:
        return SimulationFit(simulated, found, constants, None, T, blind, dropped, model)
    device = _device(here, at, model, covariance)
    return SimulationFit(simulated, found, constants, device, inverse(here) @ at, blind, dropped, model)


def fit_to_structure(simulated: Simulated, pair: Pair, rng: Generator, structure: ModelFile) -> SimulationFit:
    """The same where the simulation is made of a model: its geometry and effects enter with their covariance.

    What the model itself does not know is no difference; changes beyond it are findings of the search. DataError for a
    model without a covariance, and where an effect of it cannot be evaluated here.
    """
    known = Known(structure, same_recording=False)

    def begun(session: Session) -> Fitted:
        fit = known.begin(session)
        assumed = None if fit.problem.assumed is None else replace(fit.problem.assumed, of_difference=True)
        return replace(fit, problem=replace(fit.problem, assumed=assumed))

    found = diagnose_samples(simulated.rig, pair[0], rng, begun)
    T = device_between(simulated, pair)
    at, here = None, device_of(simulated.model)
    if found.physics is not None:
        at = device_of(predictor_of(found.physics.model.session, found.physics.model.geometry))
    if found.physics is None or at is None or here is None:
        return SimulationFit(simulated, found, (), None, T)
    model = found.physics.model
    return SimulationFit(simulated, found, (), _device(here, at, model, _covariance(model)), inverse(here) @ at)


def _with_free(simulated: Simulated, model: Fitted, limits: Mapping[str, float]) -> Fitted:
    """The model with these constants free, one sigma each in plausible sizes: at the simulation's values they would be
    taken as known, and what is correlated with them as surer than it is.
    """
    session, values = model.session, _values(simulated, model.session)
    chosen = tuple(
        replace(p, free=True, start=value, prior=limits[p.name] * p.plausible) if p.name in limits else p
        for p, value in zip(session.weighting.parameters, values, strict=True)
    )
    session = replace(session, weighting=replace(session.weighting, chosen=chosen))
    return replace(model, session=session, problem=model.problem.of_session(session)).refitted(model.accepted)


def _asked(simulated: Simulated, samples: Samples, rng: Generator, freed: Sequence[Part]) -> Diagnosed:
    names = frozenset(name for part in freed for name in part.names)
    return diagnose_samples(of_both(simulated.rig), samples, rng, lambda session: begin(simulated, session, names))


def _worth(simulated: Simulated, session: Session, freed: tuple[Part, ...], sure: tuple[Part, ...]) -> tuple[Part, ...]:
    """The same where a fit with them is better by what their numbers cost: the whole fit may have gone astray."""
    some, few = (begin(simulated, session, frozenset(n for p in parts for n in p.names)) for parts in (freed, sure))
    numbers = sum(len(part.names) for part in freed) - sum(len(part.names) for part in sure)
    gain = few.minus_two_log_likelihood - some.minus_two_log_likelihood
    return freed if gain > numbers * np.log(some.rows.data.sum()) else sure


def _still(simulated: Simulated, model: Fitted, freed: tuple[Part, ...], sure: tuple[Part, ...]) -> tuple[Part, ...]:
    """Those that differ beside the effects found, too."""
    covariance = _covariance(model)
    return tuple(p for p in freed if p in sure or _constant(simulated, model, covariance, p).p < SURE)


def _named_constants(found: Diagnosed, every: tuple[Part, ...]) -> tuple[Part, ...]:
    """Parts among the findings of a search: what only shows beside an effect."""
    if found.physics is None:
        return ()
    terms = [a.term for a in found.physics.model.accepted if a.term.depends_on == (RECORDING,)]
    places = {(_where(term), term.physics) for term in terms}
    return tuple(part for part in every if (part.where, part.physics) in places)


def _where(term: Term) -> str:
    """Of several stations or cones the one that moved."""
    number = term.variant.rpartition(" ")[2]
    return f"{term.port.where} {number}" if number.isdigit() else term.port.where


def _covariance(model: Fitted) -> Floats:
    """(param, param) of the session's parameters by what the residuals really scatter; zero of held ones."""
    parameters = model.problem.parameters
    free, scale = np.flatnonzero([p.free for p in parameters]), plausible_sizes(parameters)
    out = np.zeros((len(parameters), len(parameters)))
    out[np.ix_(free, free)] = sandwich(Bench(model), model.rows.geometry) * np.outer(scale[free], scale[free])
    n = len(model.session.parameters)
    return out[:n, :n]


def _constant(
    simulated: Simulated, model: Fitted, covariance: Floats, part: Part, rivals: tuple[Named, ...] = ()
) -> Constant:
    names = [p.name for p in model.session.parameters]
    at = [names.index(name) for name in part.names]
    apart = model.geometry[at] - _values(simulated, model.session)[at]
    return Constant(
        part.where,
        part.physics,
        part.names,
        _sizes(apart, covariance[np.ix_(at, at)]),
        _chance(apart, covariance[np.ix_(at, at)]),
        rivals,
    )


def _sizes(values: Floats, covariance: Floats) -> tuple[Size, ...]:
    sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return tuple(Size(float(v), float(s)) for v, s in zip(values, sigma, strict=True))


def _chance(values: Floats, covariance: Floats) -> float:
    """Of such values by noise alone."""
    if not np.all(np.isfinite(covariance)) or not np.any(covariance):
        return 1.0
    return float(chi2.sf(float(values @ np.linalg.pinv(covariance, hermitian=True) @ values), len(values)))


def _device(here: Floats, there: Floats, model: Fitted, covariance: Floats) -> Constant | None:
    """Shift of its origin, and turn of its axes where it has some, in the base, from simulated to measured."""
    index = {p.name: i for i, p in enumerate(model.session.parameters)}
    at = [index[name] for axis in (*AXES, *TURNS) if (name := f"device.{axis}") in index]
    if not at:
        return None
    turn = Rotation.from_matrix(there[:3, :3] @ here[:3, :3].T).as_rotvec()
    apart = np.concatenate([there[:3, 3] - here[:3, 3], turn])[: len(at)]
    axes = np.kron(np.eye(2), there[:3, :3])[: len(at), : len(at)]  # corrections are about the device's own axes
    if not np.all(np.isfinite(covariance[np.ix_(at, at)])):
        return None  # the model leaves open what the device stands against
    own = axes @ covariance[np.ix_(at, at)] @ axes.T
    p = _chance(apart, own)
    return Constant("device.pose", "device-moved", SIX[: len(at)], _sizes(apart, own), p, ()) if p < SET_UP else None


def begin(simulated: Simulated, session: Session, freed: frozenset[str] = frozenset()) -> Fitted:
    """The session under the simulation's geometry, with what is set up again fitted, its constants as candidates."""
    session = without_known(session)
    values = _values(simulated, session)
    held = tuple(_held(p, v, freed) for p, v in zip(session.weighting.parameters, values, strict=True))
    moved = np.array([p.name in freed for p in held])
    anew = np.array([p.free for p in held]) & ~moved
    start = np.where(anew, session.start, start_values(held))
    weighting = replace(session.weighting, chosen=held)
    fitted = fit_geometry(replace(session, weighting=weighting, start=start))
    return replace(fitted, problem=replace(fitted.problem, assumed=NOTHING))


def device_between(simulated: Simulated, pair: Pair) -> Floats:
    """(4, 4) where the measuring device stood, in its frame of the simulated recording; the unit without a device."""
    session = compared_session(simulated.rig, pair[0])
    if not any(p.name == "device.yaw" for p in session.parameters):
        return np.eye(4)
    measured = begin(simulated, session)
    there = device_of(predictor_of(measured.session, measured.geometry))
    here = device_of(simulated.model)
    return np.eye(4) if there is None or here is None else inverse(here) @ there


def device_of(model: Predictor) -> Floats | None:
    """T_base_device (4, 4); None where it is unknown."""
    try:
        return model.T_base_device
    except DataError:
        return None


def _held(p: Parameter, value: float, freed: frozenset[str]) -> Parameter:
    """A drawing's tolerance is about the drawing: what the measured arm is near to is the simulation."""
    if p.name.startswith(ANEW):
        return p
    if p.name in freed:
        return replace(p, start=value, prior=WIDE * p.plausible)
    return replace(p, free=False, start=value)


def _values(simulated: Simulated, session: Session) -> Floats:
    """(param,) the simulation's, about the points that this session starts from."""
    there, here = about_of(simulated.fitted.session.weighting), about_of(session.weighting)
    values, out = dict(simulated.values), start_values(session.parameters)
    values |= _turned(values, there.get("tool", ()), here.get("tool", ()))
    for i, p in enumerate(session.parameters):
        what, _, axis = p.name.partition(".")
        out[i] = values.get(p.name, out[i])
        if axis in AXES and what in there and what in here and what.startswith(("tool", TARGETS, seat.POINTS)):
            out[i] += there[what][AXES.index(axis)] - here[what][AXES.index(axis)]
    return out


def _turned(values: dict[str, float], there: tuple[float, ...], here: tuple[float, ...]) -> dict[str, float]:
    """Of a 6-D target: its turn about the orientation that this session starts from."""
    names = [f"tool.{axis}" for axis in TURNS]
    if len(there) != 6 or len(here) != 6 or not all(name in values for name in names):
        return {}
    found = Rotation.from_rotvec(there[3:]) * Rotation.from_rotvec([values[name] for name in names])
    turn = (Rotation.from_rotvec(here[3:]).inv() * found).as_rotvec()
    return dict(zip(names, turn.tolist(), strict=True))


def set_alike(simulated: Simulated, pair: Pair) -> Pair:
    """The measured readings as the device would have them where it stood in the simulated recording.

    DataError where the measured table holds no reading.
    """
    fitted = begin(simulated, compared_session(simulated.rig, pair[0]))
    model = predictor_of(fitted.session, fitted.geometry)
    here, there = device_of(simulated.model), device_of(model)
    if here is None or there is None:
        return pair
    T, changed = inverse(here) @ there, dict[str, Floats]()
    if all(name in pair[0] for name in POSITION):
        seen = _stacked(pair[0], POSITION)
        changed |= dict(zip(POSITION, (seen @ T[:3, :3].T + T[:3, 3]).T, strict=True))
    if all(name in pair[0] for name in ORIENTATION):
        changed |= dict(zip(ORIENTATION, _turned_by(_stacked(pair[0], ORIENTATION), T[:3, :3]).T, strict=True))
    for name in wire.KIND.columns:
        if name in pair[0]:
            expected = [predict(one, pair[0])[name] for one in (simulated.model, model)]
            changed[name] = pair[0].column(name) + expected[0] - expected[1]
    return columns_of(pair[0], changed), pair[1]


def _stacked(samples: Samples, names: tuple[str, ...]) -> Floats:
    return np.stack([samples.column(name) for name in names], axis=1)


def _turned_by(vectors: Floats, R: Floats) -> Floats:
    out, good = vectors.copy(), np.all(np.isfinite(vectors), axis=1)
    out[good] = (Rotation.from_matrix(R) * Rotation.from_rotvec(vectors[good])).as_rotvec()
    return out
