"""A fit plan applied: which columns are read, which arm is fitted, which parameters are free and what is assumed."""

import difflib
from collections.abc import Iterable
from dataclasses import replace
from fnmatch import fnmatchcase

import numpy as np

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from calibrate.errors import DataError
from calibrate.fit.fit_plan import AnglesName, FitPlan
from calibrate.fit.instruments import Instruments
from calibrate.model.arms.link_tolerance import LINK_PLAUSIBLE
from calibrate.model.converted_rig import rig_in_model
from calibrate.model.parameters import Parameter
from calibrate.model.sensors.catalogue import SENSORS
from calibrate.model.sensors.encoder_difference import encoder_angles


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
    chosen = tuple(_believed(p, plan) for p in parameters)
    return found if chosen == parameters else replace(found, weighting=replace(found.weighting, chosen=chosen))


def _believed(p: Parameter, plan: FitPlan) -> Parameter:
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
