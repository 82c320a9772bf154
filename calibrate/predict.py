"""What an identified model says the instruments should read: one prediction a sample, under the columns' own names."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording.columns import ORIENTATION, POSITION, SPOTS
from acquisition.recording.rig import parse_rig
from acquisition.recording.rig_schema import ArmModel, Rig
from acquisition.recording.samples import Samples
from calibrate.arms.catalogue import arm_of
from calibrate.arms.eccentric import with_discs
from calibrate.arms.model import KinematicModel
from calibrate.converted_rig import rig_in_model
from calibrate.dual_psd_rig import dual_psd_of
from calibrate.errors import DataError
from calibrate.model_file import ModelFile
from calibrate.parameters import Parameter, values_by_name
from calibrate.rigid import transform
from calibrate.sensors.device import Device
from calibrate.sensors.target import Target

Floats = NDArray[np.float64]
Columns = dict[str, Floats]

TIP = ("tip_x_m", "tip_y_m", "tip_z_m")
NOWHERE = (0.0,) * 6


@dataclass(frozen=True)
class Predictor:
    """The arm as identified, with the frames and points that were found beside it."""

    rig: Rig
    values: Mapping[str, float]  # parameter -> correction
    about: Mapping[str, tuple[float, ...]]  # what the corrections of frames and points are about
    instruments: tuple[str, ...]  # that the model was fitted to

    @classmethod
    def of(cls, model: ModelFile) -> "Predictor":
        """DataError for a model file without its rig."""
        if model.rig.text is None:
            raise DataError(f"model of rig {model.rig.name}: the rig's text is not in the file; identify again")
        rig = parse_rig(model.rig.text, f"rig.toml in the model of {model.rig.name}")
        rig = rig_in_model(rig, ArmModel(model.arm_model))
        return cls(rig, model.chain, model.about, model.instruments)

    def flange(self, q_rad: Floats) -> Floats:
        """T_base_flange (pose, 4, 4)."""
        return self._arm.flange(self.values_of(self._arm.parameters), q_rad)

    def tip_m(self, q_rad: Floats) -> Floats:
        """(pose, 3) target or probe tip in the base, at joint readings (pose, joint)."""
        return self.tip_at(self.flange(q_rad))

    def tip_at(self, T_base_flange: Floats) -> Floats:
        """(pose, 3) target or probe tip in the base, for flange poses (pose, 4, 4)."""
        return self._target.in_base(self.values_of(self._target.parameters), T_base_flange)

    @cached_property
    def T_base_device(self) -> Floats:
        """(4, 4) the measuring device. DataError where neither model nor rig knows a place."""
        place = self.about.get("device", _drawn_device(self.rig))
        if place is None:
            raise DataError(f"rig {self.rig.name}: no [device] and none in the model; fit positions or a wire first")
        device = Device(transform(place[:3], place[3:]))
        return device.T_base_device_at(self.values_of(device.parameters))

    def turn_of_target(self) -> Floats:
        """(3, 3) orientation of a 6-D target in the flange."""
        about = self.about.get("tool", NOWHERE)
        believed = Rotation.from_rotvec(about[3:6] if len(about) == 6 else NOWHERE[:3])
        found = [self.values.get(f"tool.{a}", 0.0) for a in ("roll", "pitch", "yaw")]
        return (believed * Rotation.from_rotvec(found)).as_matrix()

    def spots_m(self, q_rad: Floats, placement: NDArray[np.int64], first_psd: NDArray[np.int64]) -> Floats:
        """(pose, 4) psd1 x, y, psd2 x, y, at joint readings (pose, joint)."""
        return self.spots_at(self.flange(q_rad), placement, first_psd)

    def spots_at(self, T_base_flange: Floats, placement: NDArray[np.int64], first_psd: NDArray[np.int64]) -> Floats:
        """(pose, 4) psd1 x, y, psd2 x, y, for flange poses (pose, 4, 4)."""
        sensor = dual_psd_of(self.rig, placement, first_psd)
        return sensor.expect(self.values_of(sensor.parameters), T_base_flange)

    def seat_m(self, seat: int) -> Floats | None:
        """(3,) of a cone in the base; None for one that the model does not know."""
        start = self.about.get(f"seat{seat}")
        shift = [self.values.get(f"seat{seat}.{axis}", 0.0) for axis in "xyz"]
        return None if start is None else np.array(start) + shift

    @cached_property
    def _arm(self) -> KinematicModel:
        return with_discs(arm_of(self.rig), self.rig)

    @cached_property
    def _target(self) -> Target:
        drawn = self.rig.tool.point_m if self.rig.tool.point_m is not None else NOWHERE[:3]
        return Target(np.array(self.about.get("tool", drawn)[:3]))

    def values_of(self, parameters: tuple[Parameter, ...]) -> Floats:
        """Values of these parameters, corrections where the model has them."""
        names = {p.name for p in parameters}
        return values_by_name(parameters, {n: v for n, v in self.values.items() if n in names})


def predict(predictor: Predictor, samples: Samples) -> Columns:
    """Columns (row,) in order: what each instrument should read, and `r_...`, predicted less observed.

    Predicted are the instruments whose columns the samples have, or those of the model where the samples have none.
    NaN where a row cannot say (a spot without placement), and in `r_...` where the row holds no observation.
    """
    read = readings(predictor, predictor.flange(samples.joints()), samples)
    return {"t_s": samples.column("t_s")} | read | residuals(predictor, read, samples)


def readings(
    predictor: Predictor, T_base_flange: Floats, samples: Samples, instruments: Collection[str] | None = None
) -> Columns:
    """What each instrument should read at flange poses (row, 4, 4) of the samples; those named, or as in `predict`."""
    asked = [i for i in INSTRUMENTS if any(c in samples for c in i.asks)] if instruments is None else []
    if not asked:
        named = set(predictor.instruments if instruments is None else instruments)
        asked = [i for i in INSTRUMENTS if set(i.names) & named]
    out: Columns = {}
    for instrument in asked:
        out |= instrument.predict(predictor, T_base_flange, samples)
    return out


def residuals(predictor: Predictor, read: Columns, samples: Samples) -> Columns:
    """`r_...`: predicted less observed; of a tip in a cone that the model knows, less the cone."""
    out = {f"r_{name}": read[name] - samples.column(name) for name in read if name in samples}
    if TIP[0] in read and (at := _cones_m(predictor, samples)) is not None:
        out |= {f"r_{name}": read[name] - cone for name, cone in zip(TIP, at.T, strict=True)}
    return out


def less_cones(predictor: Predictor, read: Columns, samples: Samples) -> Columns:
    """The same readings, tips in cones that the model knows told from their cone."""
    at = _cones_m(predictor, samples) if TIP[0] in read else None
    if at is None:
        return read
    return {**read, **{name: read[name] - np.nan_to_num(cone) for name, cone in zip(TIP, at.T, strict=True)}}


def _cones_m(predictor: Predictor, samples: Samples) -> Floats | None:
    """(row, 3) in the base, NaN without one that the model knows; None where it knows none."""
    if "seat" not in samples or not any(name.startswith("seat") for name in predictor.about):
        return None
    seat = samples.integers("seat", 0)
    out = np.full((len(seat), 3), np.nan)
    for k in set(seat.tolist()):
        place = predictor.seat_m(k)
        if place is not None:
            out[seat == k] = place
    return out


@dataclass(frozen=True)
class Instrument:
    """How one instrument is predicted: fits by these names, samples that have one of these columns."""

    names: tuple[str, ...]
    asks: tuple[str, ...]
    predict: Callable[[Predictor, Floats, Samples], Columns]  # at flange poses (row, 4, 4)


def _position(predictor: Predictor, flange: Floats, samples: Samples) -> Columns:
    T = predictor.T_base_device
    return _columns(POSITION, (predictor.tip_at(flange) - T[:3, 3]) @ T[:3, :3])


def _rotation(predictor: Predictor, flange: Floats, samples: Samples) -> Columns:
    turns = predictor.T_base_device[:3, :3].T @ flange[:, :3, :3]
    vectors = Rotation.from_matrix(turns @ predictor.turn_of_target()).as_rotvec()
    if all(name in samples for name in ORIENTATION):
        vectors = _nearer_form(vectors, np.stack([samples.column(name) for name in ORIENTATION], axis=1))
    return _columns(ORIENTATION, vectors)


def _wire(predictor: Predictor, flange: Floats, samples: Samples) -> Columns:
    span = predictor.tip_at(flange) - predictor.T_base_device[:3, 3]
    return {"wire_m": np.linalg.norm(span, axis=1)}


def _spots(predictor: Predictor, flange: Floats, samples: Samples) -> Columns:
    placement, first_psd = samples.integers("placement", 0), samples.integers("first_psd", 0)
    known = np.flatnonzero((placement > 0) & (first_psd > 0))
    spots = np.full((len(samples), 4), np.nan)
    spots[known] = predictor.spots_at(flange[known], placement[known], first_psd[known])
    return _columns(SPOTS, spots)


def _tip(predictor: Predictor, flange: Floats, samples: Samples) -> Columns:
    tip = predictor.tip_at(flange)
    named = [np.isfinite(samples.column(name)) for name in ("seat", "bar") if name in samples]
    if named:
        tip[~np.logical_or.reduce(named)] = np.nan
    return _columns(TIP, tip)


def _nearer_form(vectors: Floats, observed: Floats) -> Floats:
    """(row, 3) the same rotations: of turns near half a turn the vector that is next to the observed one.

    A turn by an angle about an axis is one by the angle less 2 pi about the same axis.
    """
    angle = np.linalg.norm(vectors, axis=1, keepdims=True)
    turned_back = vectors * (1.0 - 2.0 * np.pi / np.maximum(angle, np.finfo(float).eps))
    nearer = np.linalg.norm(turned_back - observed, axis=1) < np.linalg.norm(vectors - observed, axis=1)
    return np.where(nearer[:, None], turned_back, vectors)


def _columns(names: tuple[str, ...], values: Floats) -> Columns:
    return dict(zip(names, values.T, strict=True))


def _drawn_device(rig: Rig) -> tuple[float, ...] | None:
    """Origin and rotation vector in the base, as in `about`."""
    return None if rig.device is None else (*rig.device.origin_m, *rig.device.rotation_rad)


INSTRUMENTS = (
    Instrument(("dual-psd",), SPOTS, _spots),
    Instrument(("position", "full-pose", "distance"), POSITION, _position),
    Instrument(("full-pose",), ORIENTATION, _rotation),
    Instrument(("wire",), ("wire_m",), _wire),
    Instrument(("seat", "bar"), ("seat", "bar"), _tip),
)
