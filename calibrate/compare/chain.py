"""The chain from set-point to reading, link by link: what each adds to the difference of two sessions of one motion.

A link's own difference is what is left when everything in front of it is taken out: joints less set-points, encoders
less joints, readings less what the model states the joints' difference does to them. So the first link that differs is
where the two part, and those behind it do not repeat it. Of a probe in a cone or at a bar the joints are the reading:
such rows are compared in calibrate/compare/matched.py.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import ORIENTATION, POSITION, SPOTS, per_joint
from calibrate.compare.matched import (
    LENGTH,
    bar_differences,
    is_seated,
    tip_differences,
)
from calibrate.errors import DataError
from calibrate.model.alignment import align
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.predict import Predictor, predict
from calibrate.model.sensors import (
    bar,
    position,
    seat,
    wire,
)

Floats = NDArray[np.float64]
Pair = tuple[Samples, Samples]  # measured, simulated; row by row the same pose
OfPair = Callable[[Predictor, Pair], Floats | None]  # (row, channel), NaN where either has no reading
Explained = Callable[[Predictor, Pair], Floats]


@dataclass(frozen=True, eq=False)
class Difference:
    """Measured less simulated of one link; NaN where either has no reading."""

    link: str
    names: tuple[str, ...]
    unit: str
    raw: Floats  # (row, channel)
    own: Floats  # (row, channel) without what the links in front of it explain


@dataclass(frozen=True)
class Reading:
    """An instrument at the end of the chain. `by_joints`: what a difference of the joints does to it, by the model."""

    link: str
    names: tuple[str, ...]
    unit: str
    raw: OfPair
    explained: Explained
    by_joints: Explained


def differences(model: Predictor, pair: Pair) -> tuple[Difference, ...]:
    """In the order of the chain, of the links whose columns both tables have. `model`: the simulation's geometry."""
    n = pair[0].n_joints
    upstream, seated = np.zeros((len(pair[0]), n)), is_seated(pair[0])[:, None]
    out: list[Difference] = []
    for link, stem in (("command", "cmd"), ("joints", "q"), ("encoders", "enc")):
        names = per_joint(stem, "_rad", n)
        apart = _columns_apart(pair, names)
        if apart is None:
            continue
        raw, own = apart, apart - upstream if link != "command" else apart
        if link == "encoders":  # their zeros are arbitrary
            own = _about_zero(own)
        if link == "joints":  # where the probe is seated they are the reading
            raw, own = np.where(seated, np.nan, raw), np.where(seated, np.nan, own)
        if np.any(np.isfinite(own)):
            out.append(Difference(link, names, "rad", raw, own))
        if link != "encoders":
            upstream = np.nan_to_num(apart)
    for reading in READINGS:
        raw = reading.raw(model, pair)
        if raw is not None and np.any(np.isfinite(raw)):
            out.append(Difference(reading.link, reading.names, reading.unit, raw, raw - reading.explained(model, pair)))
    return tuple(out)


def _columns_apart(pair: Pair, names: tuple[str, ...]) -> Floats | None:
    if not all(name in one for one in pair for name in names):
        return None
    measured, simulated = (np.stack([one.column(name) for name in names], axis=1) for one in pair)
    raw = measured - simulated
    return raw if np.any(np.isfinite(raw)) else None


def _about_zero(apart_rad: Floats) -> Floats:
    """(row, joint) without each joint's constant, and without whole turns."""
    middle = np.angle(np.nanmean(np.exp(1j * apart_rad), axis=0))
    wrapped = (apart_rad - middle + np.pi) % (2.0 * np.pi) - np.pi
    return wrapped - np.nanmedian(wrapped, axis=0)


def _of_columns(names: tuple[str, ...]) -> OfPair:
    return lambda model, pair: _columns_apart(pair, names)


def of_rig(rig: Rig) -> Predictor:
    """The arm as the rig draws it."""
    return Predictor(rig, {}, {}, ())


def _spots(model: Predictor, pair: Pair) -> Floats:
    return _predicted(model, pair, SPOTS)


def _wire(model: Predictor, pair: Pair) -> Floats:
    if model.rig.device is None and "device" not in model.about:
        return np.zeros((len(pair[0]), 1))
    return _predicted(model, pair, wire.KIND.columns)


def _predicted(model: Predictor, pair: Pair, names: tuple[str, ...]) -> Floats:
    said = [predict(model, one) for one in pair]
    return np.stack([said[0][name] - said[1][name] for name in names], axis=1)


def _position(model: Predictor, pair: Pair) -> Floats:
    tips = [position.seen_at(model, model.flange(one.joints()), one) for one in pair]
    return (tips[0] - tips[1]) @ device_of(model, pair[1])[:3, :3]


def _turned(model: Predictor, pair: Pair) -> Floats | None:
    """(row, 3) rotation vector from simulated to measured: a difference of two vectors would break at half a turn."""
    if not all(name in one for one in pair for name in ORIENTATION):
        return None
    seen = [np.stack([one.column(name) for name in ORIENTATION], axis=1) for one in pair]
    good = np.all(np.isfinite(np.concatenate(seen, axis=1)), axis=1)
    out = np.full(seen[0].shape, np.nan)
    if good.any():
        measured, simulated = (Rotation.from_rotvec(one[good]) for one in seen)
        out[good] = (measured * simulated.inv()).as_rotvec()
    return out


def _turned_by_joints(model: Predictor, pair: Pair) -> Floats:
    """However the target is screwed on: its mounting cancels."""
    R_base_device = device_of(model, pair[1])[:3, :3]
    measured, simulated = (model.flange(one.joints())[:, :3, :3] for one in pair)
    return Rotation.from_matrix(measured @ np.swapaxes(simulated, 1, 2)).as_rotvec() @ R_base_device


def device_of(model: Predictor, simulated: Samples) -> Floats:
    """T_base_device (4, 4): the model's, else where the simulated positions place it."""
    rig = model.rig
    if rig.device is not None or "device" in model.about:
        return model.T_base_device
    seen = np.stack([simulated.column(name) for name in POSITION], axis=1)
    good = np.all(np.isfinite(seen), axis=1)
    if good.sum() < 3:
        raise DataError(f"rig {rig.name}: no [device] and {good.sum()} positions; three are needed to find it")
    arm = arm_of(rig)
    flange = arm.flange(np.zeros(len(arm.parameters)), simulated.joints())
    tips = position.seen_at(model, flange, simulated)
    good &= np.all(np.isfinite(tips), axis=1)
    return align(tips[good], seen[good]).T_a_b


def _seats(model: Predictor, pair: Pair) -> Floats | None:
    return tip_differences(model, *pair)


def _bars(model: Predictor, pair: Pair) -> Floats | None:
    return bar_differences(model, *pair)


def _nothing(channels: int) -> Explained:
    return lambda model, pair: np.zeros((len(pair[0]), channels))


def _known(raw: OfPair, channels: int) -> Explained:
    def of(model: Predictor, pair: Pair) -> Floats:
        found = raw(model, pair)
        return np.zeros((len(pair[0]), channels)) if found is None else found

    return of


READINGS: tuple[Reading, ...] = (
    Reading("spots", SPOTS, "m", _of_columns(SPOTS), _spots, _spots),
    Reading(position.KIND.name, POSITION, "m", _of_columns(POSITION), _position, _position),
    Reading("orientation", ORIENTATION, "rad", _turned, _turned_by_joints, _turned_by_joints),
    Reading(wire.KIND.name, wire.KIND.columns, "m", _of_columns(wire.KIND.columns), _wire, _wire),
    Reading(seat.KIND.name, seat.TIP, "m", _seats, _nothing(3), _known(_seats, 3)),
    Reading(bar.KIND.name, LENGTH, "m", _bars, _nothing(1), _known(_bars, 1)),
)


def columns_of(samples: Samples, changed: Mapping[str, Floats]) -> Samples:
    """The same table with other numbers in some of its columns."""
    return Samples({**samples.columns, **changed}, samples.n_joints)
