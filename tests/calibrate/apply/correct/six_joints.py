"""A model of the shipped IRB 120 whose zeros and links are off, and the arm as its controller has it."""

from pathlib import Path

import numpy as np

from acquisition.recording.rig import parse_rig
from calibeam.motion.motion_inverse import MotionInverse
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.model_file import Covariance, ModelFile, RigIdentity

WHOLE = (Path(__file__).parents[4] / "rigs" / "irb120-modbus.toml").read_text(encoding="utf-8")
RIG = WHOLE[: WHOLE.index("[fixture]")]  # the arm and its tool: the text is read anew with every prediction
CHAIN = {"joint2.zero": 2e-3, "joint3.zero": -1.5e-3, "joint5.zero": 1e-3, "link2.length": 8e-4, "link3.twist": 1e-3}
SIGMA = 1e-5


def model(**changes):
    names = tuple(CHAIN)
    rows = tuple(tuple(SIGMA**2 if i == j else 0.0 for j in range(len(names))) for i in range(len(names)))
    fields = {
        "schema": 1,
        "kind": "calibeam-model",
        "software": "",
        "rig": RigIdentity("irb120", "0" * 64, RIG),
        "arm_model": "dh",
        "status": "CONVERGED",
        "says": "",
        "poses": 50,
        "rank": 5,
        "free": 5,
        "condition": 1.0,
        "singular_values": (1.0,),
        "unseen": (),
        "parameters": (),
        "chain": CHAIN,
        "covariance": Covariance(names, rows),
        "noise": {},
        "repeats": None,
        "held_out": None,
        "rms_coordinate_before_m": 0.0,
        "rms_distance_before_m": 0.0,
        "rms_coordinate_after_m": 0.0,
        "rms_distance_after_m": 0.0,
        "instruments": ("position",),
    }
    return ModelFile(**(fields | changes))


def drawn():
    return RigArm.of_rig(parse_rig(RIG, "rig.toml"))


def real():
    return RigArm.of_rig(parse_rig(RIG, "rig.toml"), CHAIN)


def inverse():
    return MotionInverse(drawn())


def postures(count, seed=3):
    """Far from the ends of the joints and from singular postures."""
    rng = np.random.default_rng(seed)
    return rng.uniform([-2, -0.8, -0.8, -2, 0.4, -2], [2, 0.8, 0.4, 2, 1.4, 2], (count, 6))
