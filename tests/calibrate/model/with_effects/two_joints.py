"""A stretched arm of two joints whose first one has play: a model of schema 2, small enough to check by hand."""

from calibrate.model.effect_records import EffectParameter, EffectRecord, SessionRecord
from calibrate.model.model_file import Covariance, ModelFile, RigIdentity

RIG = """schema = 1
name = "two-joints"
[arm]
model = "dh"
[[arm.joint]]
a_m = 0.3
alpha_rad = 0.0
d_m = 0.0
lower_rad = -3.2
upper_rad = 3.2
[[arm.joint]]
a_m = 0.2
alpha_rad = 0.0
d_m = 0.0
lower_rad = -3.2
upper_rad = 3.2
[tool]
point_m = [0.0, 0.0, 0.0]
[device]
origin_m = [0.0, 0.0, 0.0]
rotation_rad = [0.0, 0.0, 0.0]
"""
PLAY_RAD, SIGMA_RAD = 1e-3, 1e-5
REACH_M = 0.5  # of the stretched arm: what one radian of joint 1 moves the target along y
SIDES = [1.0, -1.0, 1.0, -1.0]


def two_joints():
    play = EffectRecord(
        name="joint1-backlash",
        where="joint1.angle",
        physics="backlash",
        depends_on="approach1",
        shape="sign",
        order=None,
        variant="",
        parameters={"backlash_rad": EffectParameter(PLAY_RAD, SIGMA_RAD, "rad")},
        coefficients={"joint1-backlash.c0": PLAY_RAD},
        inner={},
        about={},
        holds="always",
        range={},
    )
    conditions = {"t_s": [0.0, 1.0, 2.0, 3.0], "q1_rad": [0.0, 0.1, 0.2, 0.3], "q2_rad": [0.0] * 4, "approach1": SIDES}
    return ModelFile(
        schema=2,
        kind="calibeam-model",
        software="",
        rig=RigIdentity("two-joints", "0" * 64, RIG),
        arm_model="dh",
        status="CONVERGED",
        says="",
        poses=4,
        rank=1,
        free=1,
        condition=1.0,
        singular_values=(1.0,),
        unseen=(),
        parameters=(),
        chain={},
        covariance=Covariance(("joint1-backlash.c0",), ((SIGMA_RAD**2,),)),
        noise={},
        repeats=None,
        held_out=None,
        rms_coordinate_before_m=0.0,
        rms_distance_before_m=0.0,
        rms_coordinate_after_m=0.0,
        rms_distance_after_m=0.0,
        instruments=("position",),
        effects=(play,),
        needs=("approach1",),
        session=SessionRecord("", 0.0, 3.0, "0" * 64, {c: tuple(v) for c, v in conditions.items()}),
    )
