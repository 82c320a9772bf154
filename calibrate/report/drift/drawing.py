"""What the rig file draws of the parameters of an arm, so that corrections about different drawings can be compared."""

from acquisition.recording.rig import ArmModel, Joint, Rig, parse_rig
from calibrate.converted_rig import rig_in_model
from calibrate.errors import DataError
from calibrate.model_file import ModelFile

BEHIND = (("offset", "d_m"), ("length", "a_m"), ("twist", "alpha_rad"))  # of the link behind a joint
IN_FRONT = ("length", "twist")  # in a modified table these are of the link in front of it (arms/mdh.py)


def rig_of(model: ModelFile, label: str) -> Rig:
    """The rig in a model.json, its arm in the model that was fitted. DataError where the file is of an older program.

    RigFileError where its text is damaged.
    """
    if model.rig.text is None:
        raise DataError(
            f"{label}: the model does not hold its rig file, so the nominal values of its corrections are unknown; "
            "give the recording, or identify it again"
        )
    return rig_in_model(parse_rig(model.rig.text, f"{label} (rig)"), ArmModel(model.arm_model))


def drawn_values(rig: Rig) -> dict[str, float]:
    """Value on the drawing by the name of its correction; a tilt is on no drawing. Of a table of either kind."""
    out: dict[str, float] = {}
    modified = rig.arm.model is ArmModel.MDH
    for i, joint in enumerate(rig.arm.joints, start=1):
        out[f"joint{i}.zero"] = joint.theta_offset_rad or 0.0
        for what, key in BEHIND:
            link = i - 1 if modified and what in IN_FRONT else i
            out[f"link{link}.{what}"] = getattr(joint, key) or 0.0
    return out


def redrawn(now: Rig, then: Rig) -> frozenset[str]:
    """Owners ('joint3', 'link3') of parameters whose corrections are about drawings that no number joins.

    Of fixed parts in space (local-poe) those that differ; of the flange the last link and joint.
    """
    n = len(now.arm.joints)
    out: set[str] = set()
    if now.arm.flange != then.arm.flange:
        out |= {f"link{n}", f"joint{n}"}
    if now.arm.model is ArmModel.LOCAL_POE:
        pairs = enumerate(zip(now.arm.joints, then.arm.joints, strict=True))
        out |= {f"link{i}" for i, (a, b) in pairs if _part(a) != _part(b)}
    return frozenset(out)


def _part(joint: Joint) -> tuple[object, object]:
    return joint.origin_m, joint.rotation_rad
