"""A soft joint under a load: where it hangs is stated and used, or it widens sigma and is named."""

import numpy as np
import pytest
from msgspec import structs

from acquisition.recording import Samples
from calibrate.apply.predicting import predict_with_physics
from calibrate.model.effect_records import EffectParameter, EffectRecord
from calibrate.model.effects.loads import UNSTATED_CENTRE_M
from calibrate.model.with_effects.applied import conditions_of_effects
from tests.calibrate.model.with_effects.two_joints import two_joints

SOFT_RAD_NM, ARM_M, LOAD_KG, G = 1e-5, 0.5, 2.0, 9.81
JOINT = """
[[arm.joint]]
a_m = {a_m}
alpha_rad = "{alpha} deg"
d_m = 0.0
lower_rad = -3.2
upper_rad = 3.2
mass_kg = 3.0
com_m = [{com_m}, 0.0, 0.0]
"""
RIG = f"""schema = 1
name = "upright"
[arm]
model = "dh"
{JOINT.format(a_m=0.0, alpha=90, com_m=0.0)}{JOINT.format(a_m=ARM_M, alpha=0, com_m=-0.2)}
[tool]
point_m = [0.0, 0.0, 0.0]
[device]
origin_m = [0.0, 0.0, 0.0]
rotation_rad = [0.0, 0.0, 0.0]
"""
CENTRE = ("payload_com_x_m", "payload_com_y_m", "payload_com_z_m")


def soft(session=None, rig=RIG):
    """A model whose joint 2 yields to weight; `session`: further conditions that its four rows recorded."""
    model = two_joints()
    effect = EffectRecord(
        name="joint2-compliance",
        where="joint2.angle",
        physics="joint-compliance",
        depends_on="gravity_torque2",
        shape="linear",
        order=None,
        variant="",
        parameters={"compliance_rad_nm": EffectParameter(SOFT_RAD_NM, 0.0, "rad/Nm")},
        coefficients={"joint2-compliance.c0": SOFT_RAD_NM},
        inner={},
        about={},
        holds="always",
        range={},
    )
    joints = {"q1_rad": (0.0, 0.1, 0.2, 0.3), "q2_rad": (0.0, 0.4, 0.8, 1.2)}
    conditions = {"t_s": (0.0, 1.0, 2.0, 3.0), **joints, **(session or {})}
    return structs.replace(
        model,
        rig=structs.replace(model.rig, text=rig),
        effects=(effect,),
        needs=tuple(session or {}),
        covariance=structs.replace(model.covariance, names=("joint2-compliance.c0",), rows=((0.0,),)),
        session=structs.replace(model.session, conditions=conditions),
    )


def rows(**columns):
    zero = np.zeros(2)
    stated = {name: np.broadcast_to(value, 2).astype(float) for name, value in columns.items()}
    return Samples({"t_s": np.array([0.0, 1.0]), "q1_rad": zero, "q2_rad": zero, **stated}, 2)


def droop_m(model, **columns):
    """How much lower the level arm's end is than without a payload, and one sigma of it."""
    found, bare = (predict_with_physics(model, rows(**each)) for each in (columns, {"payload_kg": 0.0}))
    return bare.columns["z_m"] - found.columns["z_m"], found.columns["s_z_m"], found.notes


def sag_m(lever_m):
    return ARM_M * SOFT_RAD_NM * LOAD_KG * G * lever_m


EMPTY = {"payload_kg": (0.0,) * 4}
HUNG = dict(zip(CENTRE, (0.15, 0.0, 0.0), strict=True))


def test_a_stated_centre_is_used_and_nothing_is_uncertain():
    down, sigma, notes = droop_m(soft(EMPTY), payload_kg=LOAD_KG, **HUNG)
    np.testing.assert_allclose(down, sag_m(ARM_M + 0.15), rtol=1e-3)
    assert np.all(sigma == 0.0)
    assert notes == ()


def test_a_centre_that_is_not_stated_widens_sigma_and_is_named_with_the_remedy():
    down, sigma, notes = droop_m(soft(EMPTY), payload_kg=np.array([LOAD_KG, 0.0]))
    np.testing.assert_allclose(down, [sag_m(ARM_M), 0.0], rtol=1e-3, atol=1e-12)
    np.testing.assert_allclose(sigma, [sag_m(UNSTATED_CENTRE_M), 0.0], rtol=1e-3, atol=1e-12)
    (note,) = notes
    assert note.startswith(
        "payload_com_x_m, payload_com_y_m, payload_com_z_m are missing in 1 of 1 rows with a payload"
    )
    assert "(state them, and record them in the session)" in note
    assert note.endswith("taken at the flange, sigma widened by 0.1 m along each axis (joint2-compliance)")


def test_a_payload_that_the_session_did_not_record_acts_and_is_named():
    model = soft()
    down, _, notes = droop_m(model, payload_kg=LOAD_KG, **HUNG)
    np.testing.assert_allclose(down, sag_m(ARM_M + 0.15), rtol=1e-3)
    assert notes == ("payload_kg was not recorded in the session of the model: taken as 0 kg there; record it, 0 too",)
    assert {"payload_kg", *CENTRE} <= conditions_of_effects(model)
    assert not conditions_of_effects(two_joints()) & {"payload_kg", *CENTRE}


def test_a_centre_that_the_session_did_not_record_for_its_own_load_is_not_used():
    _, sigma, notes = droop_m(soft({"payload_kg": (0.0, 2.0, 0.0, 2.0)}), payload_kg=LOAD_KG, **HUNG)
    np.testing.assert_allclose(sigma, sag_m(UNSTATED_CENTRE_M), rtol=1e-3)
    unused, widened = notes
    assert "are not used: the session of the model carried a payload and did not record where" in unused
    assert "missing in 2 of 2 rows" in widened


def test_a_load_whose_centre_is_taken_from_the_session_is_named_too():
    """One centre in all rows of the session has no spread of its own."""
    session = {"payload_kg": (0.0, 2.0, 0.0, 2.0)} | {name: (value,) * 4 for name, value in HUNG.items()}
    down, sigma, notes = droop_m(soft(session), payload_kg=LOAD_KG)
    np.testing.assert_allclose(down, sag_m(ARM_M + 0.15), rtol=1e-3)
    np.testing.assert_allclose(sigma, sag_m(UNSTATED_CENTRE_M), rtol=1e-3)
    assert "taken where it was in the session" in notes[0]


@pytest.mark.parametrize(("com", "uncertain"), [("", True), ("com_m = [0.0, 0.0, 0.1]\n", False)])
def test_a_tool_without_a_centre_of_mass_widens_sigma_of_every_row(com, uncertain):
    rig = RIG.replace("[tool]\n", f"[tool]\nmass_kg = {LOAD_KG}\n{com}")
    model = soft(EMPTY, rig)
    found = predict_with_physics(model, rows(payload_kg=0.0))
    np.testing.assert_allclose(found.columns["s_z_m"], uncertain * sag_m(UNSTATED_CENTRE_M), rtol=1e-3, atol=1e-15)
    named = [note.startswith("rig upright: [tool] com_m is not stated (state it)") for note in found.notes]
    assert named == [True] * uncertain


def test_in_its_own_session_nothing_is_uncertain():
    """The fit has seen these rows under their load."""
    found = predict_with_physics(soft(EMPTY), rows(payload_kg=LOAD_KG), same_session=True)
    assert np.all(found.columns["s_z_m"] == 0.0)
