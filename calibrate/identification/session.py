"""The instruments of a session as an identification sees them: belief of arm and noise, what corrections are about."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording.columns import SPOTS
from acquisition.recording.rig_schema import Rig
from acquisition.recording.samples import Samples
from calibrate.arms.belief import FREE
from calibrate.arms.catalogue import arm_of
from calibrate.arms.eccentric import with_discs
from calibrate.blunders.shots import Shots
from calibrate.chain import Chain
from calibrate.default_belief import links_of
from calibrate.fit_plan import DEFAULT, FitPlan, InstrumentName
from calibrate.identification.planned import COLUMNS, as_planned, chosen_instruments, samples_as_planned
from calibrate.instruments import Instruments, instruments_of
from calibrate.sample_table import Positions, Spots
from calibrate.sensors.encoder_difference import EncoderDifference
from calibrate.sensors.full_pose import FullPose
from calibrate.sensors.position import Position
from calibrate.sensors.seat import Seat
from calibrate.sensors.wire import Wire
from calibrate.weighting import Measured, Weighting

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
About = dict[str, tuple[float, ...]]

# Instruments that see a pose from outside. What they see beyond their noise is mostly what the model lacks, and it does
# not grow as joint noise would: weights by estimated joint noise made the held-out error of a UR10 7 % worse.
OUTSIDE = ("position", "full-pose", "wire")
NEGLIGIBLE_RAD = 1e-9  # joint noise, where it is left to the instruments' own: far below any reading


def instruments_for_fit(rig: Rig, samples: Samples, plan: FitPlan = DEFAULT) -> Instruments:
    """The instruments of the samples, as planned; links are believed to the drawing tolerance.

    Without one they are free, but where there are spots, which see little of an arm: as default_belief.py.

    DataError where no row holds an observation, or where columns, rig and plan contradict each other.
    """
    as_distance, as_lines = (i in plan.instruments for i in (InstrumentName.DISTANCE, InstrumentName.POINT))
    planned = samples_as_planned(samples, plan)
    links = links_of(rig) if rig.tolerance is not None or holds_spots(planned) else FREE
    found = instruments_of(
        planned,
        rig,
        arm=with_discs(arm_of(rig, links), rig),
        positions=Positions.DISTANCE if as_distance else Positions.FRAME,
        spots=Spots.POINT if as_lines else Spots.REFLECTION,
        encoders=InstrumentName.ENCODER_DIFFERENCE in plan.instruments,
    )
    found = as_planned(chosen_instruments(found, plan), plan)
    if all(m.name in OUTSIDE for m in found.weighting.measured):
        return replace(found, weighting=replace(found.weighting, joint_rad=NEGLIGIBLE_RAD))
    return found


def holds_spots(samples: Samples) -> bool:
    """Whether any row holds spots of the dual PSD."""
    return SPOTS[0] in samples and bool(np.any(np.isfinite(samples.column(SPOTS[0]))))


def standing_at(weighting: Weighting, rows: Indices) -> Weighting:
    """The same where the samples it was made of are these rows of the file."""
    return replace(weighting, measured=tuple(replace(m, sample_rows=rows[m.sample_rows]) for m in weighting.measured))


def columns_of(measured: Measured) -> tuple[str, ...]:
    """Where a person finds the observations of this instrument in the file."""
    sensor = getattr(measured.problem.chain, "sensor", None)
    return sensor.columns if isinstance(sensor, EncoderDifference) else COLUMNS[measured.name]


def believed_sigma(measured: Measured) -> Floats:
    """(row, k) the instrument's own noise as believed, all its sources together."""
    return np.sqrt(sum((sigma**2 for sigma in measured.own_sigma.values()), np.zeros(measured.problem.observed.shape)))


def shots_of(measured: Measured, theta: Floats) -> Shots | None:
    """The view of the search for bad rows, for values of the instrument's own parameters.

    None for pairs, whose rows have no reading of their own.
    """
    problem, chain = measured.problem, measured.problem.chain
    if not isinstance(chain, Chain):
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
        sensor = getattr(measured.problem.chain, "sensor", None)
        target = getattr(sensor, "target", None)
        if target is not None:
            out["tool"] = tuple(target.point_m.tolist())
        if isinstance(sensor, FullPose):
            turn = Rotation.from_matrix(sensor.R_flange_target).as_rotvec()
            out["tool"] = (*sensor.target.point_m.tolist(), *turn.tolist())
        if isinstance(sensor, FullPose | Position | Wire):
            T = sensor.device.T_base_device
            out["device"] = (*T[:3, 3].tolist(), *Rotation.from_matrix(T[:3, :3]).as_rotvec().tolist())
        if isinstance(sensor, Seat):
            out |= {f"seat{k}": tuple(point.tolist()) for k, point in sensor.points.start_m.items()}
    return out
