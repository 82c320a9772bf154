"""What is wrong with a whole file: conventions that are not those of the rig, lengths that the readings contradict."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import ArmModel, Rig
from acquisition.recording.samples import PLANE, SEAT
from calibrate.errors import DataError
from calibrate.fit.gross_errors.conventions import wrong_convention, wrong_table
from calibrate.fit.gross_errors.joint_hypotheses import as_radians, beyond_limits
from calibrate.fit.identify.clean import mirrored_axes
from calibrate.fit.identify.rounds import coarse_start, wary_fit
from calibrate.fit.identify.session import instruments_for_fit
from calibrate.fit.weighting import Weighting
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.checks.gross_error import LIMIT, GrossError, GrossErrorKind
from calibrate.model.checks.witness import Witness
from calibrate.model.parameters import start_values
from calibrate.model.problem import Block
from calibrate.model.sensors.catalogue import witnesses_of
from calibrate.model.sensors.known_distance import KnownDistances
from calibrate.model.sensors.known_planes import KnownPlanes

Floats = NDArray[np.float64]
Stated = KnownDistances | KnownPlanes

CONFUSED = {ArmModel.DH: ArmModel.MDH, ArmModel.MDH: ArmModel.DH}
SCATTERS = 5.0  # of single balls about their seat: an arm that misses by so much errs less between two seats
NOMINAL_SHARE = 0.01  # of a length: seats alone leave the scale nominal, and links are drawn to better than this


def refuse_wrong_file(rig: Rig, samples: Samples) -> None:
    """DataError that names which conventions the file is written by, where they are not those of the rig; also for a
    rig without an arm.
    """
    if rig.n_joints == 0:
        raise DataError(
            f"rig {rig.name} has no arm: a log of encoders alone holds no poses to fit; `calibeam check` and `calibeam "
            "compare` examine it, or add [arm] to the rig file and measure poses"
        )
    if gross_errors := wrong_file(rig, samples):
        raise DataError("; besides, ".join(gross_error.says for gross_error in gross_errors))


def wrong_file(rig: Rig, samples: Samples) -> tuple[GrossError, ...]:
    """Conventions of the whole file that are not those of the rig, and lengths of the rig that the file contradicts."""
    q_rad, limits = samples.joints(), limits_rad(rig)
    in_degrees = beyond_limits(q_rad, limits)
    if in_degrees is not None:
        q_rad = as_radians(q_rad, limits)
    witnesses = witnesses_of(rig, samples, q_rad)
    found = _wrong_table(rig, witnesses) or wrong_convention(drawn_flange(rig), witnesses)
    if in_degrees is None and found is None:
        found = mirrored_axes(rig, samples)
    wrong = tuple(gross_error for gross_error in (in_degrees, found) if gross_error is not None)
    return wrong or _wrong_distances(rig, samples)


def _wrong_table(rig: Rig, witnesses: Sequence[Witness]) -> GrossError | None:
    """The two ways to write a Denavit-Hartenberg table, which a data sheet hardly ever names."""
    if (other := CONFUSED.get(rig.arm.model)) is None:
        return None
    by_other = structs.replace(rig, arm=structs.replace(rig.arm, model=other))
    return wrong_table(drawn_flange(rig), drawn_flange(by_other), other.value, witnesses)


def _wrong_distances(rig: Rig, samples: Samples) -> tuple[GrossError, ...]:
    """Known distances of seats and planes, and angles of planes, that a fit without any of them contradicts: a wrong
    number of a seat or plane, a wrong length.
    """
    if not rig.known_angles and not any(distance.of in (SEAT, PLANE) for distance in rig.known_distances):
        return ()
    found = instruments_for_fit(rig, samples)
    blocks = list(_of_touches(found.weighting.known))
    if not blocks:
        return ()
    alone = replace(found.weighting, known=())
    theta = wary_fit(alone, coarse_start(alone, found.start))  # a single wrong row is no wrong distance
    at = dict(zip((p.name for p in alone.parameters), theta, strict=True))
    scatter_m = {kind: _scatter_m(alone, kind, theta) for kind in {kind for kind, _ in blocks}}
    return tuple(
        _wrong_distance(kind, block, row, float(span), scatter_m[kind])
        for kind, block in blocks
        for row, span in enumerate(block.spans(np.array([at[p.name] for p in block.parameters])))
        if abs(span - block.stated[row])
        > LIMIT * block.sigma[row]
        + SCATTERS * scatter_m[kind] / block.levers_m[row]
        + NOMINAL_SHARE * block.stated[row]
    )


def _of_touches(known: Sequence[Block]) -> Iterator[tuple[str, Stated]]:
    """What is stated of points that an instrument touches, and which one: distances of fixtures are of the spots."""
    for block in known:
        if isinstance(block, KnownPlanes):
            yield PLANE, block
        elif isinstance(block, KnownDistances) and block.kind == SEAT:
            yield SEAT, block


def _scatter_m(alone: Weighting, kind: str, theta: Floats) -> float:
    """Within which half of the readings of an instrument are of what the fit predicts."""
    index = next(i for i, measured in enumerate(alone.measured) if measured.name == kind)
    misfit_m = alone.measured[index].problem.misfit(alone.unweighted.of_block(index, theta))
    return float(np.median(np.linalg.norm(misfit_m, axis=1)))


def _wrong_distance(kind: str, block: Stated, row: int, span: float, scatter_m: float) -> GrossError:
    first, second = block.between[row].tolist()
    angle = isinstance(block, KnownPlanes) and block.angles
    scale, unit = (1.0, "rad") if angle else (1e3, "mm apart")
    place = "known_angle" if angle else "known_distance"
    what = (
        f"{kind}s {first} and {second} are {scale * block.stated[row]:.6g} {unit} by the rig, {scale * span:.6g} "
        f"{unit} by the readings (half of the touches are within {1e3 * scatter_m:.2g} mm of their {kind})"
    )
    remedy = f"correct what this [[{place}]] states, or which rows are of which {kind}"
    return GrossError(GrossErrorKind.WRONG_DISTANCE, (), place, what, remedy)


def limits_rad(rig: Rig) -> Floats:
    return np.array([[j.lower_rad, j.upper_rad] for j in rig.arm.joints])


def drawn_flange(rig: Rig) -> Callable[[Floats], Floats]:
    """Angles (pose, joint) to (pose, 4, 4) of the nominal arm."""
    arm = arm_of(rig)
    return lambda q_rad: arm.flange(start_values(arm.parameters), q_rad)
