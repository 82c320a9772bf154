"""Whether a model may be judged by a recording: it has to be of this arm, and made of other readings."""

from acquisition.recording import Recording, readings_sha256
from acquisition.recording.rig import Arm, Rig, parse_rig
from calibrate.errors import DataError
from calibrate.model_file import ModelFile


def refuse_wrong_model(recording: Recording, model: ModelFile) -> None:
    """DataError for a model of another arm, of another probe, or of these very readings.

    An arm is known by the name of its rig and by its drawing: two of one make under one name look the same.
    """
    rig = recording.rig
    if model.rig.name != rig.name:
        raise DataError(
            f"model of rig {model.rig.name}, recording of rig {rig.name}: another arm's model says nothing of this "
            "one; give the model of this arm"
        )
    if model.rig.text is not None:
        _refuse_other_drawing(parse_rig(model.rig.text, f"rig.toml in the model of {model.rig.name}"), rig)
    if model.readings_sha256 is not None and model.readings_sha256 == readings_sha256(recording.samples):
        raise DataError(
            "the model was made of these very readings and fits them whatever it is worth; verify by others: "
            "`calibeam session RIG --verify` takes them"
        )


def _refuse_other_drawing(of_model: Rig, of_recording: Rig) -> None:
    for what, one, other in _drawings(of_model, of_recording):
        if one != other:
            raise DataError(
                f"rig {of_recording.name}: {what} of the model's rig file is not that of the recording's ({one} and "
                f"{other}); give the model of this arm, or identify it by this rig file"
            )


def _drawings(a: Rig, b: Rig) -> list[tuple[str, object, object]]:
    out: list[tuple[str, object, object]] = [
        ("arm.model", a.arm.model.value, b.arm.model.value),
        ("number of joints", a.n_joints, b.n_joints),
    ]
    joints = zip(_parts(a.arm), _parts(b.arm), strict=False)
    out += [(f"joint {i}", one, other) for i, (one, other) in enumerate(joints, start=1)]
    return [*out, ("arm.flange", a.arm.flange, b.arm.flange), ("tool.point_m", a.tool.point_m, b.tool.point_m)]


def _parts(arm: Arm) -> list[tuple[object, ...]]:
    """What is drawn of every joint; its range and its masses may be told better later."""
    drawn = ("a_m", "alpha_rad", "d_m", "theta_offset_rad", "origin_m", "rotation_rad")
    return [tuple(getattr(joint, name, None) for name in drawn) for joint in arm.joints]
