"""What an identified model says the instruments should read: one prediction a sample, under the columns' own names."""

from collections.abc import Callable, Mapping
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
from calibrate.dual_psd_rig import dual_psd_chain
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
        return self._arm.flange(self._of(self._arm.parameters), q_rad)

    def tip_m(self, q_rad: Floats) -> Floats:
        """(pose, 3) target or probe tip in the base."""
        return self._target.in_base(self._of(self._target.parameters), self.flange(q_rad))

    @cached_property
    def T_base_device(self) -> Floats:
        """(4, 4) the measuring device. DataError where neither model nor rig knows a place."""
        place = self.about.get("device", _drawn_device(self.rig))
        if place is None:
            raise DataError(f"rig {self.rig.name}: no [device] and none in the model; fit positions or a wire first")
        device = Device(transform(place[:3], place[3:]))
        return device.T_base_device_at(self._of(device.parameters))

    def turn_of_target(self) -> Floats:
        """(3, 3) orientation of a 6-D target in the flange."""
        about = self.about.get("tool", NOWHERE)
        believed = Rotation.from_rotvec(about[3:6] if len(about) == 6 else NOWHERE[:3])
        found = [self.values.get(f"tool.{a}", 0.0) for a in ("roll", "pitch", "yaw")]
        return (believed * Rotation.from_rotvec(found)).as_matrix()

    def spots_m(self, q_rad: Floats, placement: NDArray[np.int64], first_psd: NDArray[np.int64]) -> Floats:
        """(pose, 4) psd1 x, y, psd2 x, y."""
        chain = dual_psd_chain(self.rig, placement, first_psd)
        return chain.expect(self._of(chain.parameters), q_rad)

    @cached_property
    def _arm(self) -> KinematicModel:
        return with_discs(arm_of(self.rig), self.rig)

    @cached_property
    def _target(self) -> Target:
        drawn = self.rig.tool.point_m if self.rig.tool.point_m is not None else NOWHERE[:3]
        return Target(np.array(self.about.get("tool", drawn)[:3]))

    def _of(self, parameters: tuple[Parameter, ...]) -> Floats:
        names = {p.name for p in parameters}
        return values_by_name(parameters, {n: v for n, v in self.values.items() if n in names})


def predict(predictor: Predictor, samples: Samples) -> Columns:
    """Columns (row,) in order: what each instrument should read, and `r_...`, predicted less observed.

    Predicted are the instruments whose columns the samples have, or those of the model where the samples have none.
    NaN where a row cannot say (a spot without placement), and in `r_...` where the row holds no observation.
    """
    asked = [i for i in INSTRUMENTS if any(c in samples for c in i.asks)]
    if not asked:
        asked = [i for i in INSTRUMENTS if set(i.names) & set(predictor.instruments)]
    out: Columns = {"t_s": samples.column("t_s")}
    for instrument in asked:
        out |= instrument.predict(predictor, samples)
    for name in [name for name in out if name != "t_s" and name in samples]:
        out[f"r_{name}"] = out[name] - samples.column(name)
    return out


@dataclass(frozen=True)
class Instrument:
    """How one instrument is predicted: fits by these names, samples that have one of these columns."""

    names: tuple[str, ...]
    asks: tuple[str, ...]
    predict: Callable[[Predictor, Samples], Columns]


def _position(predictor: Predictor, samples: Samples) -> Columns:
    T = predictor.T_base_device
    return _columns(POSITION, (predictor.tip_m(samples.joints()) - T[:3, 3]) @ T[:3, :3])


def _rotation(predictor: Predictor, samples: Samples) -> Columns:
    turns = predictor.T_base_device[:3, :3].T @ predictor.flange(samples.joints())[:, :3, :3]
    vectors = Rotation.from_matrix(turns @ predictor.turn_of_target()).as_rotvec()
    if all(name in samples for name in ORIENTATION):
        vectors = _nearer_form(vectors, np.stack([samples.column(name) for name in ORIENTATION], axis=1))
    return _columns(ORIENTATION, vectors)


def _wire(predictor: Predictor, samples: Samples) -> Columns:
    span = predictor.tip_m(samples.joints()) - predictor.T_base_device[:3, 3]
    return {"wire_m": np.linalg.norm(span, axis=1)}


def _spots(predictor: Predictor, samples: Samples) -> Columns:
    placement, first_psd = samples.integers("placement", 0), samples.integers("first_psd", 0)
    known = np.flatnonzero((placement > 0) & (first_psd > 0))
    spots = np.full((len(samples), 4), np.nan)
    spots[known] = predictor.spots_m(samples.joints()[known], placement[known], first_psd[known])
    return _columns(SPOTS, spots)


def _tip(predictor: Predictor, samples: Samples) -> Columns:
    tip = predictor.tip_m(samples.joints())
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
