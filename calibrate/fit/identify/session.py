"""The instruments of a session as an identification sees them: prior of arm and noise, what corrections are about."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import SPOTS
from calibrate.fit.fit_plan import DEFAULT, FitPlan
from calibrate.fit.identify.planned import as_planned, chosen_instruments, samples_as_planned
from calibrate.fit.instruments import Instruments, instruments_of
from calibrate.fit.weighting import Weighting
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.eccentric import with_discs
from calibrate.model.arms.link_tolerance import FREE
from calibrate.model.checks.shots import Shots
from calibrate.model.default_tolerance import links_of
from calibrate.model.measured import Measured
from calibrate.model.sensors.catalogue import kind_of, names_with
from calibrate.model.sensors.kind import Trait

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
About = dict[str, tuple[float, ...]]

# A device beside the arm sees a pose from outside. What it sees beyond its noise is mostly what the model lacks, and
# that does not grow as joint noise would: weights by estimated joint noise made the held-out error of a UR10 7 % worse.
OUTSIDE = names_with(Trait.DEVICE)
NEGLIGIBLE_RAD = 1e-9  # joint noise, where it is left to the instruments' own: far below any reading


def instruments_for_fit(rig: Rig, samples: Samples, plan: FitPlan = DEFAULT) -> Instruments:
    """The instruments of the samples, as planned; links have the drawing tolerance for a prior.

    Without one they are free, but where there are spots, which see little of an arm: as default_belief.py.

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


def believed_sigma(measured: Measured) -> Floats:
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

    sigma = np.median(believed_sigma(measured), axis=0)
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
