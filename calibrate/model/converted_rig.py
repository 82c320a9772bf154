"""A rig whose arm is written in another model; what stands in the base frame moves along where the base has to."""

from msgspec.structs import replace

from acquisition.recording.rig import ArmModel, Pose, Rig, parse_rig
from calibrate.errors import DataError
from calibrate.model.arms.convert import Conversion, convert, pose_of
from calibrate.model.model_file import ModelFile
from calibrate.model.rigid import inverse, transform

EXACT_M = 1e-9  # rounding of a chain of metres is far below


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
