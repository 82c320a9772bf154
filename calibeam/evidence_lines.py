"""Proofs of an identification as lines for a terminal."""

from calibrate.identification.result import Evidence, FreeSpace, Unseen
from calibrate.observability import Observability
from calibrate.sensors.catalogue import thousandth_of


def lines_of(evidence: Evidence) -> list[str]:
    """Held-out error, observability, free space, bootstrap; what was not asked for is not spoken of."""
    out = [_held_out(unseen) for unseen in evidence.proven.held_out]
    out += [f"no proof ({why})" for why in evidence.proven.unproven]
    if evidence.observability is not None:
        out.append(_observability(evidence.observability))
    if evidence.free_space is not None:
        out += _free_space(evidence.free_space)
    if evidence.bootstrap is not None:
        drawn = evidence.bootstrap
        out.append(f"bootstrap: {len(drawn.theta)} refits to drawn rows, {drawn.failed} more without an answer")
    return out


def _held_out(unseen: Unseen) -> str:
    return (
        f"held out ({unseen.split}): {unseen.name}, {unseen.observations} rows, "
        f"{1e3 * unseen.rms_distance_before_m:.4g} {thousandth_of(unseen.name)} rms distance before, "
        f"{1e3 * unseen.rms_distance_after_m:.4g} {thousandth_of(unseen.name)} after"
    )


def _observability(shown: Observability) -> str:
    indices = ", ".join(f"O{i} {v:.3g}" for i, v in enumerate((shown.o1, shown.o2, shown.o3, shown.o4, shown.o5), 1))
    well = "" if shown.well_conditioned else " (usual limit 100: other poses would show more)"
    return f"observability of {shown.n_free} parameters: {indices}, condition {shown.condition:.3g}{well}"


def _free_space(room: FreeSpace) -> list[str]:
    one, pose = room.geometry, room.pose
    if one.rms_m is None or one.p95_m is None or one.max_m is None:
        return [f"free space: {one.status.value}", *(f"  {words}" for words in one.undetermined)]
    out = [
        f"free space, {room.poses} poses drawn evenly between the joint limits: {1e3 * one.rms_m:.3g} mm rms, "
        f"{1e3 * one.p95_m:.3g} mm at 95 %, {1e3 * one.max_m:.3g} mm at most (one sigma of the identified geometry)"
    ]
    if pose.rms_m is not None and pose.p95_m is not None and pose.max_m is not None:
        out.append(
            f"  of a single pose: {1e3 * pose.rms_m:.3g} mm rms, {1e3 * pose.p95_m:.3g} mm at 95 %, "
            f"{1e3 * pose.max_m:.3g} mm at most, with {room.scatter_says}"
        )
    if one.guessed:
        out.append(f"  known no better than their plausible size: {'; '.join(one.guessed)}")
    return out
