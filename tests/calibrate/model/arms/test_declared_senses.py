"""An arm with declared signs and couplings is the drawn arm at the angles that the controller means."""

import numpy as np
import pytest

from acquisition.motion.inverse.closed_form import closed_form
from acquisition.motion.inverse.solve import Solver
from acquisition.recording import Samples
from acquisition.recording.rig import ArmModel, load_rig, parse_rig
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.convert import convert, corrected_parts, flange_of_parts
from calibrate.model.arms.link_tolerance import FREE
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.effects.conditions import conditions_of, recoupled_samples, uncoupled_samples
from calibrate.model.effects.loads import stated_masses

RNG = np.random.default_rng(8)
NUMBERS = RNG.uniform(-0.6, 0.6, (6, 7)).round(3).tolist()


def text(model, signs=(), follows=None):
    """A crooked arm of six joints with masses, of any model."""
    out = f'schema = 1\nname = "crooked"\n[arm]\nmodel = "{model}"\n'
    if model != "local-poe":
        out += "base = { origin_m = [0.1, 0.2, 0.3], rotation_rad = [0.2, 0.1, -0.3] }\n"
    for i, (a, b, c, d, e, f, g) in enumerate(NUMBERS, start=1):
        table = f"a_m = {a}\nalpha_rad = {4 * b}\nd_m = {c}\ntheta_offset_rad = {d}\n"
        poe = f"origin_m = [{a}, {c}, {d}]\nrotation_rad = [{b}, {4 * e}, {f}]\n"
        out += "[[arm.joint]]\nlower_rad = -2\nupper_rad = 2.5\n" + (poe if model == "local-poe" else table)
        out += f"mass_kg = {1 + i}\ncom_m = [{e}, {f}, {g}]\n"
        out += "sign = -1\n" if i in signs else ""
        out += f"follows = {{ joint = {follows[1]}, by = {follows[2]} }}\n" if follows and i == follows[0] else ""
    return out + "[arm.flange]\norigin_m = [0.1, 0.02, 0.03]\nrotation_rad = [0.5, -0.2, 0.9]\n"


MODELS = [model.value for model in ArmModel]
SIGNS = [(1,), (6,), (1, 4, 6), (2, 3), (1, 2, 3, 4, 5, 6)]


def rigs(model, signs, follows=None):
    return parse_rig(text(model), "drawn"), parse_rig(text(model, signs, follows), "counted")


def meant(q_rad, signs, follows=None):
    """Angles in the drawn sense of what a controller reports: coupled in its own numbers first."""
    out = q_rad.copy()
    if follows:
        out[:, follows[0] - 1] += follows[2] * q_rad[:, follows[1] - 1]
    return out * np.where(np.isin(np.arange(1, 7), signs), -1.0, 1.0)


def readings(n=30):
    return np.random.default_rng(2).uniform(-1.9, 1.9, (n, 6))


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("signs", SIGNS, ids=str)
@pytest.mark.parametrize("follows", [None, (3, 2, 1.0), (5, 1, -1.0)], ids=["alone", "3 by 2", "5 by -1"])
def test_the_flange_is_where_the_drawn_arm_has_it(model, signs, follows):
    drawn, counted = rigs(model, signs, follows)
    q_rad = readings()
    there = RigArm.of_rig(drawn).frames(meant(q_rad, signs, follows))[:, -1]
    np.testing.assert_allclose(RigArm.of_rig(counted).frames(q_rad)[:, -1], there, atol=1e-12)
    arm = arm_of(counted)
    np.testing.assert_allclose(arm.flange(np.zeros(len(arm.parameters)), q_rad), there, atol=1e-12)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("signs", SIGNS, ids=str)
def test_centres_of_mass_stay_where_they_are_drawn(model, signs):
    class Driven:
        def __init__(self, rig, q_rad):
            self.rig, self.q_rad, self.n_joints = rig, q_rad, 6
            self.frames = RigArm.of_rig(rig).frames(q_rad)

    drawn, counted = rigs(model, signs)
    q_rad = readings(1)
    there, here = Driven(drawn, meant(q_rad, signs)), Driven(counted, q_rad)
    for (mass, i, com), (other, j, seen) in zip(stated_masses(there), stated_masses(here), strict=True):
        assert (mass, i) == (other, j)
        at = there.frames[0, i, :3, :3] @ np.array(com) + there.frames[0, i, :3, 3]
        np.testing.assert_allclose(
            here.frames[0, j, :3, :3] @ np.array(seen) + here.frames[0, j, :3, 3], at, atol=1e-12
        )


@pytest.mark.parametrize("model", MODELS)
def test_derivatives_by_readings_and_parameters_are_those_of_the_flange(model):
    _, counted = rigs(model, (1, 4), (3, 2, 1.0))
    arm, q_rad = arm_of(counted, FREE), readings(4)
    theta = np.random.default_rng(3).normal(0.0, 1e-3, len(arm.parameters))
    step, T = 1e-6, arm.flange(theta, q_rad)

    def twist(moved, back):
        d = (moved - back) / (2.0 * step)
        W = d[:, :3, :3] @ np.swapaxes(T[:, :3, :3], 1, 2)
        w = np.stack([W[:, 2, 1], W[:, 0, 2], W[:, 1, 0]], axis=1)
        return np.concatenate([d[:, :3, 3] - np.cross(w, T[:, :3, 3]), w], axis=1)

    by_reading = arm.joint_twists(theta, q_rad)
    for j, one in enumerate(step * np.eye(6)):
        moved = twist(arm.flange(theta, q_rad + one), arm.flange(theta, q_rad - one))
        np.testing.assert_allclose(by_reading[..., j], moved, atol=1e-8)
    by_parameter = arm.twists(theta, q_rad)
    for k, one in enumerate(step * np.eye(len(theta))):
        moved = twist(arm.flange(theta + one, q_rad), arm.flange(theta - one, q_rad))
        np.testing.assert_allclose(by_parameter[..., k], moved, atol=1e-8)


def test_compiled_loops_know_of_a_coupling(monkeypatch):
    from calibrate.model.arms import compiled

    _, counted = rigs("dh", (2,), (3, 2, 1.0))
    arm, q_rad = arm_of(counted, FREE), readings(20)
    theta = np.zeros(len(arm.parameters))
    plain = arm.flange(theta, q_rad), arm.twists(theta, q_rad)
    constants = compiled.ArmConstants.of(arm, theta)
    np.testing.assert_allclose(compiled.flange(constants, q_rad), plain[0], atol=1e-12)
    np.testing.assert_allclose(compiled.twists(constants, q_rad), plain[1], atol=1e-12)


@pytest.mark.parametrize("model", list(ArmModel))
def test_a_conversion_keeps_senses_and_couplings(model):
    _, counted = rigs("local-poe", (1, 4), (3, 2, 1.0))
    made = convert(counted.arm, model)
    assert made.error.position_max_m < 1e-9
    assert made.arm.joints[2].follows == counted.arm.joints[2].follows
    q_rad = readings()
    new = flange_of_parts(corrected_parts(made.arm, made.corrections), meant(q_rad, (), (3, 2, 1.0)))
    np.testing.assert_allclose(made.T_base_new @ new, RigArm.of_rig(counted).frames(q_rad)[:, -1], atol=1e-9)


@pytest.mark.parametrize("name", ["fanuc-lrmate-200id", "kuka-kr6-r900", "motoman-gp8", "ur20"])
def test_a_pose_is_found_again_in_the_robots_own_numbers(request, name):
    rig = load_rig(request.config.rootpath / "calibeam" / "shipped_rigs" / f"{name}.toml")
    arm = RigArm.of_rig(rig)
    solver = Solver(arm, closed_form(arm))
    assert solver.starts is not None
    for q_rad in np.random.default_rng(5).uniform(0.5 * arm.lower_rad, 0.5 * arm.upper_rad, (5, 6)):
        found = solver.nearest(arm.flange(q_rad), q_rad + 0.01)
        np.testing.assert_allclose(found, q_rad, atol=1e-6)


def test_drives_see_a_coupled_joint_from_the_link_in_front():
    _, counted = rigs("dh", (), (3, 2, 1.0))
    q_rad = readings(8)
    columns = {f"q{i + 1}_rad": q_rad[:, i] for i in range(6)} | {"t_s": np.arange(8.0)}
    columns |= {f"approach{i + 1}": np.ones(8) for i in range(6)}
    seen = conditions_of(uncoupled_samples(counted.arm, Samples(columns, 6)), {})
    np.testing.assert_allclose(seen.q_rad[:, 2], q_rad[:, 1] + q_rad[:, 2])
    np.testing.assert_array_equal(seen.approach[1:, 2], np.sign(np.diff(q_rad[:, 1] + q_rad[:, 2])))
    np.testing.assert_array_equal(seen.approach[:, 3], 1.0)


def test_a_command_of_the_coupled_joint_alone_is_as_far_off_its_reading_as_recorded():
    _, counted = rigs("dh", (), (3, 2, 1.0))
    q_rad, off_rad = readings(8), 1e-3
    columns = {f"q{i + 1}_rad": q_rad[:, i] for i in range(6)} | {
        "t_s": np.arange(8.0),
        "cmd3_rad": q_rad[:, 2] + off_rad,
    }
    samples = Samples(columns, 6)
    inner = uncoupled_samples(counted.arm, samples)
    seen = conditions_of(inner, {})
    np.testing.assert_allclose(seen.cmd_minus_q_rad[:, 2], off_rad, atol=1e-12)
    again = recoupled_samples(counted.arm, inner)
    for name, values in columns.items():
        np.testing.assert_allclose(again.column(name), values, atol=1e-12, err_msg=name)


def test_a_row_without_a_command_leaves_those_of_other_joints():
    _, counted = rigs("dh", (), (3, 2, 1.0))
    q_rad = readings(8)
    columns = {f"q{i + 1}_rad": q_rad[:, i] for i in range(6)} | {"t_s": np.arange(8.0)}
    columns |= {f"cmd{i + 1}_rad": q_rad[:, i] + 1e-3 for i in range(6)}
    columns["cmd5_rad"] = np.full(8, np.nan)
    seen = conditions_of(uncoupled_samples(counted.arm, Samples(columns, 6)), {}).cmd_minus_q_rad
    np.testing.assert_allclose(seen, np.tile([1e-3, 1e-3, 2e-3, 1e-3, 0.0, 1e-3], (8, 1)), atol=1e-12)
