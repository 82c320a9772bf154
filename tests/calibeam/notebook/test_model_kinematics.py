"""`model.forward` and `model.inverse` undo each other with physics, on six and seven axes, one or many at a time."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import calibeam
from calibrate.model.effect_records import EffectParameter, EffectRecord, SessionRecord
from calibrate.model.model_file import Covariance, RigIdentity
from tests.calibrate.apply.correct.six_joints import RIG, model, postures

SHIPPED = Path(calibeam.__file__).parent / "shipped_rigs"
PANDA = (SHIPPED / "franka-panda.toml").read_text(encoding="utf-8")
CLOSE = 1e-9  # m and of a rotation matrix: what the documentation states
SOFT_RAD_NM = 2e-5


def effect(joint, physics, depends_on, shape, coefficients, order=None):
    parameters = {"size": EffectParameter(max(coefficients.values()), None, "rad")}
    return EffectRecord(
        name=f"joint{joint}-{physics}", where=f"joint{joint}.angle", physics=physics, depends_on=depends_on,
        shape=shape, order=order, variant="", parameters=parameters, coefficients=coefficients, inner={}, about={},
        holds="always", range={},
    )  # fmt: skip


def with_physics(text, chain, table):
    """Joint 2 yields to its torque; the encoder disc of joint 4 sits off its centre."""
    soft = effect(2, "joint-compliance", "gravity_torque2", "linear", {"joint2-joint-compliance.c0": SOFT_RAD_NM})
    waves = {"joint4-encoder-eccentricity.c0": 2e-4, "joint4-encoder-eccentricity.c1": 1e-4}
    disc = effect(4, "encoder-eccentricity", "q4", "harmonic", waves, order=1)
    held = {f"q{j + 1}_rad": tuple(column.tolist()) for j, column in enumerate(table.T)}
    load = {"payload_kg": tuple(np.linspace(0.0, 2.0, len(table)).tolist())}
    session = SessionRecord("", 0.0, 19.0, "0" * 64, held | {"t_s": tuple(map(float, range(len(table))))} | load)
    file = model(
        schema=2, effects=(soft, disc), session=session, covariance=Covariance((), ()), instruments=(), chain=chain,
        needs=("payload_kg",), rig=RigIdentity("arm", "0" * 64, text),
    )  # fmt: skip
    return calibeam.Model(file, "unknown", "", ())


def panda_postures(count, seed=3):
    rng = np.random.default_rng(seed)
    middle = np.array([0.0, 0.3, 0.2, -1.8, 0.3, 2.0, 0.5])
    return middle + rng.uniform(-0.4, 0.4, (count, 7))


ARMS = {
    "six axes": (RIG, postures, {"joint2.zero": 2e-3, "joint3.zero": -1.5e-3, "link2.length": 8e-4}),
    "seven axes": (PANDA, panda_postures, {"joint2.zero": 2e-3, "joint4.zero": -1e-3, "joint6.zero": 1e-3}),
}
LOADS = {"payload_kg": np.linspace(0.0, 2.0, 12)}


@pytest.fixture(params=ARMS)
def arm(request):
    text, drawn, chain = ARMS[request.param]
    return with_physics(text, chain, drawn(20, seed=4)), drawn(12)


def away(q_rad, seed=5):
    return q_rad + np.random.default_rng(seed).uniform(-0.05, 0.05, q_rad.shape)


@pytest.mark.filterwarnings("ignore:pose .*beyond the calibrated range")
def test_forward_of_inverse_is_the_pose(arm):
    known, q_rad = arm
    wanted = known.forward(q_rad, LOADS)
    found_rad = known.inverse(wanted, LOADS, near_rad=away(q_rad))
    assert np.abs(known.forward(found_rad, LOADS) - wanted).max() < CLOSE
    if q_rad.shape[1] == 6:
        assert np.abs(found_rad - q_rad).max() < 1e-7
    assert np.abs(found_rad - q_rad).max() < 0.3  # seven axes: stays near


@pytest.mark.filterwarnings("ignore:pose .*beyond the calibrated range")
def test_physics_and_load_count(arm):
    known, q_rad = arm
    rigid = calibeam.Model(model(chain=known.file.chain, rig=known.file.rig), "unknown", "", ())
    apart_m = np.linalg.norm((known.forward(q_rad, LOADS) - rigid.forward(q_rad))[:, :3, 3], axis=1)
    assert np.median(apart_m) > 1e-5
    assert apart_m.max() > 1e-4
    light = known.forward(q_rad, {"payload_kg": 0.0})[:, 2, 3]
    assert known.forward(q_rad, LOADS)[-1, 2, 3] < light[-1] - 1e-5  # 2 kg pull down what 0 kg do not


@pytest.mark.filterwarnings("ignore:pose .*beyond the calibrated range")
def test_many_poses_are_solved_as_each_alone(arm):
    known, q_rad = arm
    wanted, near_rad = known.forward(q_rad, LOADS), away(q_rad)
    together = known.inverse(wanted, LOADS, near_rad=near_rad)
    for row in range(len(q_rad)):
        conditions = {"payload_kg": LOADS["payload_kg"][row]}
        alone = known.inverse(wanted[row], conditions, near_rad=near_rad[row])
        assert np.abs(alone[0] - together[row]).max() < CLOSE
        assert np.abs(known.forward(q_rad[row], conditions)[0] - wanted[row]).max() < 1e-12


def test_a_stated_tool_is_moved_with_the_flange():
    known, tool = calibeam.Model(model(), "unknown", "", ()), np.eye(4)
    tool[:3, 3] = 0.0, 0.02, 0.15
    q_rad = postures(3)
    T = known.forward(q_rad, tool=tool)
    assert np.allclose(np.linalg.inv(T) @ known.forward(q_rad, tool=np.eye(4)), np.linalg.inv(tool), atol=1e-12)
    assert np.abs(known.inverse(T, near_rad=q_rad, tool=tool) - q_rad).max() < 1e-8


def test_the_inverse_is_what_correct_commands():
    known, q_rad = calibeam.Model(model(), "unknown", "", ()), postures(4)
    wanted = known.forward(q_rad, nominal=True)
    assert np.allclose(known.inverse(wanted, near_rad=q_rad), known.correct(wanted, near_rad=q_rad).q_rad, atol=1e-9)


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"T": np.zeros((2, 3))}, r"poses of shape \(2, 3\)"),
        ({"T": np.diag([1.0, 1.0, -1.0, 1.0])}, "each a rotation"),
        ({"T": np.full((4, 4), np.nan)}, "each a rotation"),
        ({"near_rad": np.zeros(5)}, r"near_rad of shape \(5,\): give \(6,\) or \(1, 6\)"),
        ({"near_rad": np.full(6, np.nan)}, "all finite"),
        ({"conditions": {"payload_kg": np.zeros(3)}}, r"condition payload_kg of shape \(3,\)"),
    ],
)
def test_input_that_is_none_is_refused(changed, says):
    known = calibeam.Model(model(), "unknown", "", ())
    given = {"T": np.eye(4), "conditions": None, "near_rad": np.zeros(6)} | changed
    with pytest.raises(calibeam.DataError, match=says):
        known.inverse(given["T"], given["conditions"], near_rad=given["near_rad"])


def test_joints_of_another_shape_are_refused():
    known = calibeam.Model(model(), "unknown", "", ())
    with pytest.raises(calibeam.DataError, match=r"joint angles of shape \(2, 5\): give \(pose, 6\) or \(6,\)"):
        known.forward(np.zeros((2, 5)))


def test_a_pose_out_of_reach_is_named_by_its_number():
    known, q_rad = calibeam.Model(model(), "unknown", "", ()), postures(3)
    wanted = known.forward(q_rad)
    wanted[1, :3, 3] *= 10.0
    with pytest.raises(calibeam.DataError, match=r"pose \[1\]: out of reach of the nominal arm; move the pose"):
        known.inverse(wanted, near_rad=q_rad)


def test_a_pose_near_a_singular_posture_is_named():
    """Joint 5 is nearly zero: joints 4 and 6 turn about one axis."""
    known = calibeam.Model(model(), "unknown", "", ())
    q_rad = np.array([[0.3, 0.2, -0.3, 0.5, 0.8, 0.4], [0.3, 0.2, -0.3, 0.5, 0.004, 0.4]])
    wanted = known.forward(q_rad, nominal=True)
    with pytest.warns(UserWarning, match=r"pose \[1\]: near a singular posture: the correction turns joint [46] by"):
        found_rad = known.inverse(wanted, near_rad=q_rad)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.abs(known.forward(found_rad) - wanted).max() < CLOSE
