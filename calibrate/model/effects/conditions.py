"""The conditions that every row of samples was taken under, from the columns of the samples alone, before any model."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Arm
from acquisition.recording.samples import CONTROLLER, joint_of, per_joint
from calibrate.model.arms.coupled_readings import by_reading
from calibrate.model.effects.drivers import Conditions
from calibrate.model.sensors.catalogue import SENSORS

Floats = NDArray[np.float64]

MOVED_RAD = 1e-4  # a joint that went less far has not moved: two readings of one standstill
SMOOTHING = 0.01  # of the samples, at least 3: thermometers are noisy, what they measure is slow
NAMED = {
    *(name for kind in SENSORS for name in (*kind.columns, *kind.further)),
    *("t_s", "target", "placement", "first_psd", "psd1_sum_v", "psd2_sum_v", "repeat"),
    *CONTROLLER,
    *("payload_kg", "payload_com_x_m", "payload_com_y_m", "payload_com_z_m"),
}


def conditions_of(samples: Samples, temperatures_degC: Mapping[str, Floats]) -> Conditions:
    """Of any table of samples; temperatures (sample,) by place, as `temperatures_of` or as they were kept."""
    n, q = samples.n_joints, samples.joints()
    moves, direction = moves_of(samples)
    recorded = _per_joint(samples, "approach", "", n)
    return Conditions(
        q_rad=q,
        t_s=samples.column("t_s"),
        approach=direction if recorded is None else recorded,
        approach_derived=recorded is None,
        last_move_rad=moves,
        qd_rad_s=_per_joint(samples, "qd", "_rad_s", n),
        cmd_minus_q_rad=_per_joint(samples, "cmd", "_rad", n, q),
        temperatures_degC=temperatures_degC,
        payload_kg=np.nan_to_num(samples.column("payload_kg")) if _recorded(samples, "payload_kg") else None,
        payload_com_m=_stacked(samples, ("payload_com_x_m", "payload_com_y_m", "payload_com_z_m")),
        psd_sum_v=_stacked(samples, ("psd1_sum_v", "psd2_sum_v")),
        extra=_extra(samples, n),
        repeat=samples.integers("repeat", -1) if "repeat" in samples else None,
    )


def uncoupled_samples(arm: Arm, samples: Samples) -> Samples:
    """The samples with all that they hold of joints counted from the link in front, as drives and bearings see it.

    A joint that follows another one has moved where the sum of both has: its `approach` is then the sign of its last
    move. Second encoders sit on a joint and stay as they are.
    """
    matrix = by_reading(arm)
    if matrix is None:
        return samples
    out = _by_matrix(matrix, samples)
    columns, (moves, direction) = dict(out.columns), moves_of(out)
    turned = np.where(np.abs(moves) > MOVED_RAD, np.sign(moves), direction)
    for i in np.flatnonzero(np.any(matrix != np.eye(out.n_joints), axis=1)):
        if (name := f"approach{i + 1}") in columns:
            columns[name] = turned[:, i]
    return Samples(columns, out.n_joints)


def recoupled_samples(arm: Arm, samples: Samples) -> Samples:
    """Samples of `uncoupled_samples`, such as a model keeps, with angles, speeds and moves as the controller counts."""
    matrix = by_reading(arm)
    return samples if matrix is None else _by_matrix(np.asarray(np.linalg.inv(matrix), dtype=np.float64), samples)


def _by_matrix(matrix: Floats, samples: Samples) -> Samples:
    """Angles, commands, speeds and moves (row, joint) turned by a matrix (joint, joint).

    A joint without the column, or a row without a value, counts as one that does what it was commanded and as it moved.
    """
    n, columns, q_rad = samples.n_joints, dict(samples.columns), samples.joints()
    unrecorded = {"cmd": q_rad, "qd": np.zeros_like(q_rad), "last_move": moves_of(samples)[0]}
    for stem, unit in (("q", "_rad"), ("cmd", "_rad"), ("qd", "_rad_s"), ("last_move", "_rad")):
        names, empty = per_joint(stem, unit, n), np.full(len(samples), np.nan)
        read = np.stack([samples.column(name) if name in samples else empty for name in names], axis=1)
        known = np.isfinite(read)
        turned = np.where(known, read, unrecorded.get(stem, q_rad)) @ matrix.T
        turned[~known] = np.nan
        columns |= {name: turned[:, i] for i, name in enumerate(names) if name in samples}
    return Samples(columns, n)


def _per_joint(samples: Samples, stem: str, unit: str, n: int, less: Floats | None = None) -> Floats | None:
    """(sample, joint), less what is given of each; None where no joint has the column, zero for one that lacks it: a
    model keeps the columns of those joints alone that its effects need.
    """
    names = per_joint(stem, unit, n)
    if not any(_recorded(samples, name) for name in names):
        return None
    unrecorded = np.full(len(samples), np.nan)
    values = np.stack([samples.column(c) if c in samples else unrecorded for c in names], axis=1)
    return np.nan_to_num(values if less is None else values - less)


def moves_of(samples: Samples) -> tuple[Floats, Floats]:
    """(sample, joint) last move, and the sign of the last one that was a move: by the order in time where no column
    holds it.
    """
    moves, direction = _moves(samples.joints(), samples.column("t_s"))
    names = per_joint("last_move", "_rad", samples.n_joints)
    for joint, name in enumerate(names):
        if _recorded(samples, name):
            moves[:, joint] = np.nan_to_num(samples.column(name))
    return moves, direction


def _moves(q_rad: Floats, t_s: Floats) -> tuple[Floats, Floats]:
    """(sample, joint) move from the sample before in time, and the sign of the last move that was one."""
    order = np.argsort(t_s, kind="stable")
    in_time = np.diff(q_rad[order], axis=0, prepend=q_rad[order[:1]])
    signs = np.where(np.abs(in_time) > MOVED_RAD, np.sign(in_time), 0.0)
    for row in range(1, len(signs)):
        signs[row] = np.where(signs[row] == 0.0, signs[row - 1], signs[row])
    moves, direction = np.empty_like(in_time), np.empty_like(signs)
    moves[order], direction[order] = in_time, signs
    return moves, direction


def temperatures_of(samples: Samples) -> dict[str, Floats]:
    """Smoothed in the order of time, but not across a pause: what cooled meanwhile is no noise.

    A thermometer that is read now and then has between two readings what lies between them.
    """
    t = samples.column("t_s")
    order = np.argsort(t, kind="stable")
    width = max(3.0, SMOOTHING * len(samples))
    steps = np.diff(t[order])
    pauses = 1 + np.flatnonzero(steps > width * np.median(steps)) if len(steps) else np.zeros(0, dtype=np.intp)
    out: dict[str, Floats] = {}
    for name in samples.names:
        if _is_temperature(name) and _recorded(samples, name):
            from scipy.ndimage import gaussian_filter1d  # without temperatures a command starts sooner

            read = samples.column(name)
            known = order[np.isfinite(read[order])]
            values = np.interp(t, t[known], read[known])
            smooth = np.empty_like(values)
            for run in np.split(order, pauses):
                smooth[run] = gaussian_filter1d(values[run], width, mode="nearest")
            out[name.removeprefix("temp_").removesuffix("_degC")] = smooth
    return out


def _is_temperature(name: str) -> bool:
    return name.startswith("temp_") and name.endswith("_degC")


def _recorded(samples: Samples, name: str) -> bool:
    """Whether a column holds anything: an empty one was not recorded, whatever its heading."""
    return name in samples and bool(np.isfinite(samples.column(name)).any())


def _stacked(samples: Samples, names: tuple[str, ...]) -> Floats | None:
    if not all(_recorded(samples, name) for name in names):
        return None
    return np.stack([_filled(samples.column(name)) for name in names], axis=1)


def _extra(samples: Samples, n: int) -> dict[str, Floats]:
    """Numeric columns that the format does not name and that vary."""
    out: dict[str, Floats] = {}
    for name in samples.names:
        if name in NAMED or name.endswith("_sigma_m") or _is_temperature(name) or joint_of(name) is not None:
            continue
        values = samples.column(name)
        if np.isfinite(values).any() and np.ptp(values[np.isfinite(values)]) > 0.0:
            out[name] = _filled(values)
    return out


def _filled(values: Floats) -> Floats:
    """Empty cells take the middle of the others: they show nothing."""
    good = np.isfinite(values)
    return np.where(good, values, np.median(values[good]) if good.any() else 0.0)
