"""A model as the rig and the mechanisms of an emulated world."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibeam.simulation.physics import physics_of
from calibeam.simulation.rig_in_numbers import arm_in_numbers, light_of, tracker_of
from calibeam.simulation.scene_of_samples import rest_degC
from calibrate.errors import DataError
from calibrate.model.model_file import ModelFile
from calibrate.model.predict import Predictor
from simulators.arm.drawing import origin_and_rotation
from simulators.defects import Defect
from simulators.defects.defect import as_vector
from simulators.defects.found_curve import FoundCurve
from simulators.replayed import Sited
from simulators.world.moving_mechanisms import temperatures
from simulators.world.rig import Pose
from simulators.world.truth import Given, TruePlacement

FOLLOWED = ("q", "gravity_torque", "qd", "last_move", "approach", "spot")  # drivers of a curve, with a number


def emulated(model: ModelFile, rig: Rig) -> tuple[Given, tuple[Defect, ...], tuple[str, ...]]:
    """Geometry and mechanisms, and sentences on what is left out. DataError for a model of another arm, and for
    one that knows no laser where the rig has one.

    An emulated session is none of those that the model was found in.
    """
    predictor = Predictor.of(model)
    n, its = len(rig.arm.joints), len(predictor.rig.arm.joints)
    if its != n:
        raise DataError(f"the model is of an arm of {its} joints, the rig of one of {n}; give the model of this rig")
    physics = physics_of(model, predictor, n, same_recording=False)
    names = {id(made): name for name, made in physics.named}
    mechanisms: list[Defect] = []
    notes = list(physics.notes)
    for made in physics.mechanisms:
        why = _unfit(made, n)
        if why:
            name = names.get(id(made), made.defect.KIND)
            notes.append(f"left out: {name}, {physics.sizes.get(name, 'geometry')}: {why}")
        else:
            mechanisms.append(made.defect)
    given = _given(model, predictor, rig)
    if rig.devices.tracker is not None and given.device is None:
        notes.append("the model does not know where a tracker stands: its place and the target are those of the seed")
    return given, tuple(mechanisms), tuple(notes)


def _given(model: ModelFile, predictor: Predictor, rig: Rig) -> Given:
    arm, light, seen = arm_in_numbers(predictor), light_of(predictor), tracker_of(predictor)
    plain = Given(
        parts=tuple(_pose(part) for part in arm.fixed),
        joint_zero_rad=tuple(arm.zero_rad.tolist()),
        rest_degC=rest_degC(model),
    )
    if rig.devices.tracker is not None and seen is not None:
        target_m = as_vector(predictor.tip_at(np.eye(4)[np.newaxis])[0])
        plain = structs.replace(plain, device=_pose(seen.device), target_m=target_m)
    if light is None:
        if rig.fixture is not None:
            raise DataError(f"rig {rig.name} has a laser and a fixture, the model has none; give a model of such a rig")
        return plain
    fixture = light[0]
    return structs.replace(
        plain,
        laser_origin_m=as_vector(fixture.laser_origin_m),
        laser_direction=as_vector(fixture.laser_direction),
        placements=tuple(TruePlacement(k, _pose(fixture.places[k - 1])) for k in sorted(predictor.rig.placements)),
        psd2_in_psd1=_pose(fixture.psd2_in_psd1),
    )


def _unfit(made: Sited, n_joints: int) -> str:
    """Why the emulated world cannot have it; "" where it can."""
    if made.where not in ("", "past"):
        return "it sits in an instrument that is not emulated"
    places = temperatures(np.zeros(1), n_joints)
    where = vars(made.defect).get("where")
    if isinstance(where, str) and where and where not in places:
        return f"no thermometer {where} is emulated"
    if isinstance(made.defect, FoundCurve):
        strange = [name for name in made.defect.by if not _followed(name, places)]
        return f"its driver {strange[0]} is not emulated" if strange else ""
    return ""


def _followed(name: str, places: Mapping[str, Any]) -> bool:
    stem = name.rstrip("0123456789")
    return name == "t" or (stem in FOLLOWED and stem != name) or name.removeprefix("temp_") in places


def _pose(frame: NDArray[np.float64]) -> Pose:
    return Pose(*origin_and_rotation(frame))
