"""A session prepared for its fit: the fit plan applied, and the instruments with their priors.

The plan decides which columns are read, which arm is fitted, which parameters are free and what is assumed of them.
"""

import difflib
from collections.abc import Iterable
from dataclasses import replace
from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import SPOTS
from calibrate.errors import DataError
from calibrate.fit.fit_plan import DEFAULT, AnglesName, FitPlan
from calibrate.fit.instruments import Instruments, instruments_of
from calibrate.fit.weighting import Weighting
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.eccentric import with_discs
from calibrate.model.arms.link_tolerance import FREE, LINK_PLAUSIBLE
from calibrate.model.checks.gross_error import Shots
from calibrate.model.default_tolerance import links_of
from calibrate.model.parameters import Parameter
from calibrate.model.predict import rig_in_model
from calibrate.model.problem import Measured
from calibrate.model.sensors.catalogue import SENSORS, kind_of, names_with
from calibrate.model.sensors.encoder_difference import encoder_angles
from calibrate.model.sensors.kind import Trait

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
About = dict[str, tuple[float, ...]]
# A device beside the arm sees a pose from outside. What it sees beyond its noise is mostly what the model lacks, and
# that does not grow as joint noise would: weights by estimated joint noise made the held-out error of a UR10 7 % worse.
OUTSIDE = names_with(Trait.DEVICE)
NEGLIGIBLE_RAD = 1e-9  # joint noise, where it is left to the instruments' own: far below any reading


def rig_as_planned(rig: Rig, plan: FitPlan) -> Rig:
    """The rig with its arm in the model of the plan. DataError where it cannot be written so."""
    return rig if plan.model is None else rig_in_model(rig, plan.model)


def samples_as_planned(samples: Samples, plan: FitPlan) -> Samples:
    """The samples with the angles of the plan, without the columns of instruments that it leaves out.

    DataError where it asks for second encoders and a joint has none that follows it.
    """
    if plan.angles is AnglesName.ENCODERS:
        samples = encoder_angles(samples)
    if not plan.instruments:
        return samples
    listed = {kind.name: {*kind.columns, *kind.further} for kind in SENSORS}
    kept = set[str]().union(*(listed[name] for name in plan.instruments))
    dropped = set[str]().union(*listed.values()) - kept
    return Samples({name: c for name, c in samples.columns.items() if name not in dropped}, samples.n_joints)


def chosen_instruments(found: Instruments, plan: FitPlan) -> Instruments:
    """Those of the plan. DataError for one that the samples do not have."""
    if not plan.instruments:
        return found
    wanted = plan.instruments
    there = [m.name for m in found.weighting.measured]
    for name in wanted:
        if name not in there:
            raise DataError(f"fit plan: instrument '{name}': the samples hold no row of it; they have {_listed(there)}")
    kept = tuple(m for m in found.weighting.measured if m.name in wanted)
    weighting = replace(found.weighting, measured=kept)
    start = dict(zip((p.name for p in found.weighting.parameters), found.start.tolist(), strict=True))
    return replace(found, weighting=weighting, start=np.array([start[p.name] for p in weighting.parameters]))


def as_planned(found: Instruments, plan: FitPlan) -> Instruments:
    """Parameters held, freed and put under priors by the plan. DataError for a pattern that no parameter matches."""
    parameters = found.weighting.parameters
    for pattern in (*plan.free, *plan.priors, *plan.hold):
        _refuse_idle(pattern, [p.name for p in parameters])
    chosen = tuple(_with_prior_of(p, plan) for p in parameters)
    return found if chosen == parameters else replace(found, weighting=replace(found.weighting, chosen=chosen))


def _with_prior_of(p: Parameter, plan: FitPlan) -> Parameter:
    if _matches(p.name, plan.free):
        plausible = max(p.plausible, LINK_PLAUSIBLE) if p.name.startswith("link") else p.plausible
        p = replace(p, free=True, prior=np.inf, plausible=plausible, assumed=False)
    for pattern, sigma in plan.priors.items():
        if fnmatchcase(p.name, pattern):
            p = replace(p, free=True, prior=sigma, plausible=max(p.plausible, sigma), assumed=False)
    return replace(p, free=False) if _matches(p.name, plan.hold) else p


def _matches(name: str, patterns: Iterable[str]) -> bool:
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def _refuse_idle(pattern: str, names: list[str]) -> None:
    if not any(fnmatchcase(name, pattern) for name in names):
        near = difflib.get_close_matches(pattern, names, n=1)
        hint = f"did you mean '{near[0]}'?" if near else f"there are {_listed(names)}"
        raise DataError(f"fit plan: no parameter of this session matches '{pattern}'; {hint}")


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names)


def instruments_for_fit(rig: Rig, samples: Samples, plan: FitPlan = DEFAULT) -> Instruments:
    """The instruments of the samples, as planned; links have the drawing tolerance for a prior.

    Without one they are free, but where there are spots, which see little of an arm: as default_tolerance.py.

    DataError where no row holds an observation, or where columns, rig and plan contradict each other.
    """
    planned = samples_as_planned(samples, plan)
    links = links_of(rig) if rig.tolerance is not None or holds_spots(planned) else FREE
    found = instruments_of(planned, rig, arm=with_discs(arm_of(rig, links), rig), asked=plan.instruments)
    found = as_planned(chosen_instruments(found, plan), plan)
    return replace(found, weighting=joints_apart(found.weighting))


def joints_apart(weighting: Weighting) -> Weighting:
    """Noise of the joints is left to that of the instruments where all of these measure the arm from outside."""
    outside = all(m.name in OUTSIDE for m in weighting.measured)
    return replace(weighting, joint_rad=NEGLIGIBLE_RAD) if outside else weighting


def holds_spots(samples: Samples) -> bool:
    """Whether any row holds spots of the dual PSD."""
    return SPOTS[0] in samples and bool(np.any(np.isfinite(samples.column(SPOTS[0]))))


def standing_at(weighting: Weighting, rows: Indices) -> Weighting:
    """The same where the samples it was made of are these rows of the file."""
    return replace(weighting, measured=tuple(replace(m, sample_rows=rows[m.sample_rows]) for m in weighting.measured))


def columns_of(measured: Measured) -> tuple[str, ...]:
    """Where a person finds the observations of this instrument in the file."""
    return measured.problem.chain.sensor.own_columns() or kind_of(measured.name).columns


def assumed_sigma(measured: Measured) -> Floats:
    """(row, k) the instrument's own noise as assumed, all its sources together."""
    return np.sqrt(sum((sigma**2 for sigma in measured.own_sigma.values()), np.zeros(measured.problem.observed.shape)))


def shots_of(measured: Measured, theta: Floats) -> Shots | None:
    """The view of the search for bad rows, for values of the instrument's own parameters.

    None for pairs, whose rows have no reading of their own.
    """
    problem, chain = measured.problem, measured.problem.chain
    if measured.sample_rows.shape[1] > 1:
        return None

    def expect(observations: Indices, q_rad: Floats) -> Floats:
        return chain.select(observations).expect(theta, q_rad)

    sigma = np.median(assumed_sigma(measured), axis=0)
    rows = measured.sample_rows[:, 0]
    return Shots(rows, columns_of(measured), problem.q_rad, problem.observed, sigma, expect)


def about_of(weighting: Weighting) -> About:
    """Frames and points that the corrections of a fit are about; names as in model_file.ModelFile.about."""
    out: About = {}
    for measured in weighting.measured:
        for name, place in measured.problem.chain.sensor.about().items():
            if len(place) >= len(out.get(name, ())):  # of a target's place and orientation, whoever sees both
                out[name] = place
    return out
