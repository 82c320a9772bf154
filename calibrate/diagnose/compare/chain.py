"""The chain from set-point to reading, link by link: what each adds to the difference of two sessions of one motion.

A link's own difference is what is left when everything in front of it is taken out: joints less set-points, encoders
less joints, readings less what the model says the joints' difference does to them. So the first link that differs is
where the two part, and those behind it do not repeat it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.columns import ORIENTATION, POSITION, SPOTS, per_joint
from acquisition.recording.rig_schema import Rig
from acquisition.recording.samples import Samples
from calibrate.alignment import align
from calibrate.arms.catalogue import arm_of
from calibrate.errors import DataError
from calibrate.predict import NOWHERE, Predictor, predict

Floats = NDArray[np.float64]
Pair = tuple[Samples, Samples]  # measured, simulated; row by row the same pose


@dataclass(frozen=True, eq=False)
class Difference:
    """Measured less simulated of one link; NaN where either has no reading."""

    link: str
    names: tuple[str, ...]
    unit: str
    raw: Floats  # (row, channel)
    own: Floats  # (row, channel) without what the links in front of it explain


def differences(rig: Rig, pair: Pair) -> tuple[Difference, ...]:
    """In the order of the chain, of the links whose columns both tables have."""
    n = pair[0].n_joints
    upstream = np.zeros((len(pair[0]), n))
    out: list[Difference] = []
    for link, stem in (("command", "cmd"), ("joints", "q"), ("encoders", "enc")):
        names = per_joint(stem, "_rad", n)
        raw = _raw(pair, names)
        if raw is None:
            continue
        out.append(Difference(link, names, "rad", raw, raw - upstream if link != "command" else raw))
        if link != "encoders":
            upstream = np.nan_to_num(raw)
    for link, names, unit, explained in READINGS:
        raw = _raw(pair, names)
        if raw is not None:
            out.append(Difference(link, names, unit, raw, raw - explained(rig, pair)))
    return tuple(out)


def _raw(pair: Pair, names: tuple[str, ...]) -> Floats | None:
    if not all(name in one for one in pair for name in names):
        return None
    measured, simulated = (np.stack([one.column(name) for name in names], axis=1) for one in pair)
    raw = measured - simulated
    return raw if np.any(np.isfinite(raw)) else None


def of_rig(rig: Rig) -> Predictor:
    """The arm as the rig draws it."""
    return Predictor(rig, {}, {}, ())


def _spots(rig: Rig, pair: Pair) -> Floats:
    return _predicted(rig, pair, SPOTS)


def _wire(rig: Rig, pair: Pair) -> Floats:
    if rig.device is None:
        return np.zeros((len(pair[0]), 1))
    return _predicted(rig, pair, ("wire_m",))


def _predicted(rig: Rig, pair: Pair, names: tuple[str, ...]) -> Floats:
    model = of_rig(rig)
    said = [predict(model, one) for one in pair]
    return np.stack([said[0][name] - said[1][name] for name in names], axis=1)


def _position(rig: Rig, pair: Pair) -> Floats:
    model = of_rig(rig)
    tips = [model.tip_m(one.joints()) for one in pair]
    return (tips[0] - tips[1]) @ device_of(rig, pair[1])[:3, :3]


def _rotation(rig: Rig, pair: Pair) -> Floats:
    return np.zeros((len(pair[0]), 3))  # told as raw: a rotation vector is no vector, and turns say what positions say


def device_of(rig: Rig, simulated: Samples) -> Floats:
    """T_base_device (4, 4): the rig's, else where the simulated positions say that it stands."""
    model = of_rig(rig)
    if rig.device is not None:
        return model.T_base_device
    seen = np.stack([simulated.column(name) for name in POSITION], axis=1)
    good = np.all(np.isfinite(seen), axis=1)
    if good.sum() < 3:
        raise DataError(f"rig {rig.name}: no [device] and {good.sum()} positions; three are needed to find it")
    arm = arm_of(rig)
    flange = arm.flange(np.zeros(len(arm.parameters)), simulated.joints())
    point = np.array(rig.tool.point_m if rig.tool.point_m is not None else NOWHERE[:3])
    tips = flange[:, :3, :3] @ point + flange[:, :3, 3]
    return align(tips[good], seen[good]).T_a_b


Explained = Callable[[Rig, Pair], Floats]
READINGS: tuple[tuple[str, tuple[str, ...], str, Explained], ...] = (
    ("spots", SPOTS, "m", _spots),
    ("position", POSITION, "m", _position),
    ("orientation", ORIENTATION, "rad", _rotation),
    ("wire", ("wire_m",), "m", _wire),
)


def columns_of(samples: Samples, changed: Mapping[str, Floats]) -> Samples:
    """The same table with other numbers in some of its columns."""
    return Samples({**samples.columns, **changed}, samples.n_joints)
