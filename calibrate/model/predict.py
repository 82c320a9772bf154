"""What the instruments should read by an identified model: one prediction a sample, under the columns' own names.

A rig written in another arm model is converted; what stands in the base frame moves along where the base has to.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import ArmModel, Pose, Rig, parse_rig
from calibrate.errors import DataError
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.convert import Conversion, convert, pose_of
from calibrate.model.arms.eccentric import EccentricArm, with_discs
from calibrate.model.arms.serial import SerialArm
from calibrate.model.chain import KinematicModel
from calibrate.model.dual_psd_rig import dual_psd_of
from calibrate.model.model_file import ModelFile
from calibrate.model.parameters import Parameter, values_by_name
from calibrate.model.placement import Target
from calibrate.model.rigid import inverse, transform
from calibrate.model.sensors.catalogue import SENSORS
from calibrate.model.sensors.kind import Columns
from calibrate.model.sensors.position import device_of
from calibrate.model.sensors.seat import TIP as TIP
from calibrate.model.sensors.seat import cone_m

EXACT_M = 1e-9  # rounding of a chain of metres is far below
Floats = NDArray[np.float64]
NOWHERE = (0.0,) * 6


def rig_in_model(rig: Rig, model: ArmModel) -> Rig:
    """The same rig in another arm model. DataError where that leaves an error, or needs a number no rig file has."""
    if rig.arm.model is model:
        return rig
    made = convert(rig.arm, model)
    if made.corrections or made.error.position_max_m > EXACT_M:
        needs = ", ".join(f"{name} = {value:.3g} rad" for name, value in made.corrections.items())
        why = f"it needs {needs}" if needs else f"{made.error.position_max_m:.2g} m are left"
        raise DataError(f"rig {rig.name}: its nominal arm is no '{model.value}': {why}; keep '{rig.arm.model.value}'")
    placements = tuple(replace(p, psd1_in_base=_in_new_base(p.psd1_in_base, made)) for p in rig.placement_list)
    device = None if rig.device is None else _in_new_base(rig.device, made)
    return replace(rig, arm=made.arm, placement_list=placements, device=device)


def rig_of_model(model: ModelFile) -> Rig:
    """The rig of a model file, in the arm model of its parameters. DataError for a file without its rig."""
    if model.rig.text is None:
        raise DataError(f"model of rig {model.rig.name}: the rig's text is not in the file; identify again")
    rig = parse_rig(model.rig.text, f"rig.toml in the model of {model.rig.name}")
    return rig_in_model(rig, ArmModel(model.arm_model))


def _in_new_base(pose: Pose, made: Conversion) -> Pose:
    return pose_of(inverse(made.T_base_new) @ transform(pose.origin_m, pose.rotation_rad))


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
        return cls(rig_of_model(model), model.chain, model.about, model.instruments)

    def flange(self, q_rad: Floats) -> Floats:
        """T_base_flange (pose, 4, 4)."""
        return self._arm.flange(self.values_of(self._arm.parameters), q_rad)

    def tip_m(self, q_rad: Floats) -> Floats:
        """(pose, 3) target or probe tip in the base, at joint readings (pose, joint)."""
        return self.tip_at(self.flange(q_rad))

    def tip_at(self, T_base_flange: Floats) -> Floats:
        """(pose, 3) target or probe tip in the base, for flange poses (pose, 4, 4)."""
        return self._target.in_base(self.values_of(self._target.parameters), T_base_flange)

    def found_m(self, name: str, stated_m: tuple[float, ...]) -> Floats:
        """(3,) in the flange, of the target of this name ("tool", "target1" ...), which the rig file states there."""
        shift = [self.values.get(f"{name}.{axis}", 0.0) for axis in "xyz"]
        return np.array(self.about.get(name, stated_m)[:3]) + np.array(shift)

    def measured_at(self, T_base_flange: Floats) -> Floats:
        """(pose, 3) a point that was measured, in the base: the tip, or the first of several targets."""
        for k, target in self.rig.targets.items():
            if f"target{k}.x" in self.values:
                point_m = self.found_m(f"target{k}", target.point_m)
                return T_base_flange[:, :3, :3] @ point_m + T_base_flange[:, :3, 3]
        return self.tip_at(T_base_flange)

    @cached_property
    def T_base_device(self) -> Floats:
        """(4, 4) the measuring device. DataError where neither model nor rig knows a place."""
        return device_of(self)

    def turn_of_target(self) -> Floats:
        """(3, 3) orientation of a 6-D target in the flange."""
        about = self.about.get("tool", NOWHERE)
        nominal = Rotation.from_rotvec(about[3:6] if len(about) == 6 else NOWHERE[:3])
        found = [self.values.get(f"tool.{a}", 0.0) for a in ("roll", "pitch", "yaw")]
        return (nominal * Rotation.from_rotvec(found)).as_matrix()

    def spots_m(self, q_rad: Floats, placement: NDArray[np.int64], first_psd: NDArray[np.int64]) -> Floats:
        """(pose, 4) psd1 x, y, psd2 x, y, at joint readings (pose, joint)."""
        return self.spots_at(self.flange(q_rad), placement, first_psd)

    def spots_at(self, T_base_flange: Floats, placement: NDArray[np.int64], first_psd: NDArray[np.int64]) -> Floats:
        """(pose, 4) psd1 x, y, psd2 x, y, for flange poses (pose, 4, 4)."""
        sensor = dual_psd_of(self.rig, placement, first_psd)
        return sensor.expect(self.values_of(sensor.parameters), T_base_flange)

    def seat_m(self, seat: int) -> Floats | None:
        """(3,) of a cone in the base; None for one that the model does not know."""
        return cone_m(self, seat)

    @cached_property
    def arm(self) -> SerialArm:
        """Whose frames effects act at, behind its encoder discs."""
        return arm_of(self.rig)

    @cached_property
    def _arm(self) -> KinematicModel:
        return with_discs(self.arm, self.rig)

    @cached_property
    def _target(self) -> Target:
        drawn = self.rig.tool.point_m if self.rig.tool.point_m is not None else NOWHERE[:3]
        return Target(np.array(self.about.get("tool", drawn)[:3]))

    def at_shafts(self, q_rad: Floats) -> Floats:
        """(pose, joint) readings less the errors of encoder discs that the model has numbers of; arms/eccentric.py."""
        arm = self._arm
        return arm.at_shafts(self.values_of(arm.parameters), q_rad) if isinstance(arm, EccentricArm) else q_rad

    def values_of(self, parameters: tuple[Parameter, ...]) -> Floats:
        """Values of these parameters, corrections where the model has them."""
        names = {p.name for p in parameters}
        return values_by_name(parameters, {n: v for n, v in self.values.items() if n in names})


def predict(predictor: Predictor, samples: Samples) -> Columns:
    """Columns (row,) in order: what each instrument should read, and `r_...`, predicted less observed.

    Predicted are the instruments whose columns the samples have, or those of the model where the samples have none.
    NaN where a row has none (a spot without placement), and in `r_...` where the row holds no observation.
    """
    read = readings(predictor, predictor.flange(samples.joints()), samples)
    return {"t_s": samples.column("t_s")} | read | residuals(predictor, read, samples)


def readings(
    predictor: Predictor, T_base_flange: Floats, samples: Samples, instruments: Collection[str] | None = None
) -> Columns:
    """What each instrument should read at flange poses (row, 4, 4) of the samples; those named, or as in `predict`.

    A model that knows readings only as another kind uses them, positions as distances, predicts that kind.
    """
    asked = [k for k in SENSORS if any(c in samples for c in k.asks)] if instruments is None else []
    other = [k for k in SENSORS if k.name in predictor.instruments and k.instead_of and k.predict is not None]
    asked = list(dict.fromkeys(next((o for o in other if k.name in o.instead_of), k) for k in asked))
    if not asked:
        named = set(predictor.instruments if instruments is None else instruments)
        asked = [kind for kind in SENSORS if kind.name in named]
    out: Columns = {}
    for kind in asked:
        if kind.predict is not None:
            out |= kind.predict(predictor, T_base_flange, samples)
    return out


def residuals(predictor: Predictor, read: Columns, samples: Samples) -> Columns:
    """`r_...`: predicted less observed; of a tip in a cone that the model knows, less the cone."""
    out = {f"r_{name}": read[name] - samples.column(name) for name in read if name in samples}
    return out | {f"r_{name}": read[name] - at for name, at in _fixed(predictor, read, samples).items()}


def less_cones(predictor: Predictor, read: Columns, samples: Samples) -> Columns:
    """The same readings, tips in cones that the model knows read from their cone."""
    fixed = _fixed(predictor, read, samples)
    return {**read, **{name: read[name] - np.nan_to_num(at) for name, at in fixed.items()}}


def _fixed(predictor: Predictor, read: Columns, samples: Samples) -> Columns:
    """What was observed of readings that no column holds: where the cones are."""
    out: Columns = {}
    for kind in SENSORS:
        if kind.reads and kind.reads[0] in read:
            out |= kind.observed(predictor, samples) or {}
    return out
