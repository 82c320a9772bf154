"""Each mechanism changes what the drives give by its law, against inverse dynamics of the plain model in MuJoCo."""

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pytest

from simulators.defects import Defect
from simulators.defects.torque import (
    Coulomb,
    GearRipple,
    HeavyRotor,
    JointSpring,
    LateTorque,
    LeaningGravity,
    LoadFriction,
    Stribeck,
    TorqueOffset,
    UnstatedPayload,
    Viscous,
    WrongTorqueConstant,
)
from simulators.world.model import STEP_S, build_mjcf
from simulators.world.rig import read_rig
from simulators.world.truth import draw_truth
from simulators.world.world import World

START_RAD = np.array([0.3, -1.4, 1.6, -0.5, 0.5, 0.0])
WAYS_RAD = np.array([0.5, 0.3, 0.4, 0.6, 0.5, 0.7])
RATES_RAD_S = np.array([2.1, 1.7, 2.3, 1.9, 2.5, 2.9])
MOVES_S = 4.0
TURNS_RAD_S = 0.05  # below it a law of the sense of motion is not tested
AGREE = 0.02  # of the greatest torque of the law


def course_rad(time_s: float) -> np.ndarray:
    return START_RAD + WAYS_RAD * np.sin(RATES_RAD_S * time_s) ** 2


class Driven:
    """An arm on its course: state and torque of each step, (step, 6), and the plain model's torques for that motion."""

    def __init__(self, rig: dict[str, Any], hidden: tuple[Defect, ...]) -> None:
        self.model: Any = mujoco.MjModel.from_xml_string(build_mjcf(read_rig(rig), draw_truth(read_rig(rig), 7)))
        world = World.from_rig(rig, q_rad=START_RAD, hidden=hidden)
        q, qd, torque, flange = [], [], [], []
        for step in range(round(MOVES_S / STEP_S)):
            if step % 2 == 0:
                world.command(course_rad((step + 2) * STEP_S))
            q.append(world.true_joints_rad())
            qd.append(world.joints().qd_rad_s.copy())
            flange.append(world.T_base_flange())
            world.advance((step + 1) * STEP_S)
            torque.append(world.joints().torque_nm)
        self.qdd = np.diff(qd, axis=0) / STEP_S
        self.q, self.qd, self.torque = np.array(q)[:-1], np.array(qd)[:-1], np.array(torque)[:-1]
        self.flange = np.array(flange)[:-1]
        self.links = self.inverse_dynamics()

    def inverse_dynamics(self) -> np.ndarray:
        data: Any = mujoco.MjData(self.model)
        out = np.empty_like(self.q)
        for row in range(len(out)):
            data.qpos[:], data.qvel[:], data.qacc[:] = self.q[row], self.qd[row], self.qdd[row]
            mujoco.mj_inverse(self.model, data)
            out[row] = data.qfrc_inverse
        return out

    @property
    def beyond(self) -> np.ndarray:
        """What the drives give beyond the links, (step, 6)."""
        return self.torque - of_cycles(self.links)


def of_cycles(values: np.ndarray) -> np.ndarray:
    """Of each step (step, 6) and the one before, as a controller with a cycle of two steps reports it."""
    return 0.5 * (values + np.concatenate([values[:1], values[:-1]]))


def at(joint: int, values: np.ndarray) -> np.ndarray:
    out = np.zeros((len(values), 6))
    out[:, joint - 1] = values
    return out


def load_friction(d: Driven) -> np.ndarray:
    return at(2, 0.1 * np.abs(d.links[:, 1]) * np.sign(d.qd[:, 1]))


def payload(d: Driven) -> np.ndarray:
    """J' m (a - g) of the mass, with its acceleration from where it is in three steps."""
    com = np.array([0.02, 0.0, 0.05, 1.0])
    point = (d.flange @ com)[:, :3]
    force = np.zeros_like(point)
    force[1:-1] = 2.0 * (np.diff(point, n=2, axis=0) / STEP_S**2 + [0.0, 0.0, 9.81])
    data: Any = mujoco.MjData(d.model)
    flange = d.model.site("flange").bodyid[0]
    out, jacobian = np.zeros_like(d.q), np.empty((3, 6))
    for row in range(len(out)):
        data.qpos[:] = d.q[row]
        mujoco.mj_fwdPosition(d.model, data)
        mujoco.mj_jac(d.model, data, jacobian, None, point[row], flange)
        out[row] = jacobian.T @ force[row]
    return out


def gravity(d: Driven) -> np.ndarray:
    """Rotated by hand, about x and then about y."""
    plain = d.inverse_dynamics()
    (sx, cx), (sy, cy) = (np.sin(0.02), np.cos(0.02)), (np.sin(-0.01), np.cos(-0.01))
    d.model.opt.gravity[:] = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]) @ [0.0, 9.81 * sx, -9.81 * cx]
    return d.inverse_dynamics() - plain


def of_links(joint: int, share: float) -> Callable[[Driven], np.ndarray]:
    return lambda d: at(joint, share * d.links[:, joint - 1])


LAWS: list[tuple[Defect, Callable[[Driven], np.ndarray]]] = [
    (Coulomb(3, 4.0), lambda d: at(3, 4.0 * np.sign(d.qd[:, 2]))),
    (Viscous(1, 6.0), lambda d: at(1, 6.0 * d.qd[:, 0])),
    (Stribeck(4, 5.0, 0.3), lambda d: at(4, 5.0 * np.exp(-((d.qd[:, 3] / 0.3) ** 2)) * np.sign(d.qd[:, 3]))),
    (LoadFriction(2, 0.1), load_friction),
    (JointSpring(2, 25.0, -1.0), lambda d: at(2, 25.0 * (d.q[:, 1] + 1.0))),
    (GearRipple(5, 1.5, 2, 101.0), lambda d: at(5, 1.5 * np.sin(202.0 * d.q[:, 4]))),
    (HeavyRotor(6, 0.3), lambda d: at(6, 0.3 * d.qdd[:, 5])),
    (UnstatedPayload(2.0, (0.02, 0.0, 0.05)), payload),
    (LeaningGravity(0.02, -0.01), gravity),
    (WrongTorqueConstant(2, -0.1), of_links(2, -0.1)),
    (TorqueOffset(6, 1.2), lambda d: at(6, np.full(len(d.q), 1.2))),
]


@pytest.mark.parametrize(("defect", "law"), LAWS, ids=lambda one: getattr(one, "KIND", ""))
def test_the_drives_give_what_the_law_takes(
    ur5e: Callable[..., dict[str, Any]], defect: Defect, law: Callable[[Driven], np.ndarray]
) -> None:
    driven = Driven(ur5e(), (defect,))
    expected = of_cycles(law(driven))
    wide = np.abs(expected).max()
    turning = (np.abs(driven.qd) > TURNS_RAD_S).all(axis=1)
    turning[1:] &= turning[:-1]
    turning[:5] = turning[-5:] = False
    assert wide > 0.1
    assert np.count_nonzero(turning) > 1000
    np.testing.assert_allclose(driven.beyond[turning], expected[turning], atol=AGREE * wide)


def test_a_late_torque_is_that_of_before_between_two_steps(ur5e: Callable[..., dict[str, Any]]) -> None:
    now, late = Driven(ur5e(), ()).torque, Driven(ur5e(), (LateTorque(2, 0.0035),)).torque
    np.testing.assert_allclose(late[4:, 1], 0.5 * (now[:-4, 1] + now[1:-3, 1]), rtol=1e-12)
    np.testing.assert_array_equal(np.delete(late, 1, axis=1), np.delete(now, 1, axis=1))


ALL = (*(defect for defect, _ in LAWS), LateTorque(2, 0.0035))


def test_the_same_numbers_however_time_is_cut(ur5e: Callable[..., dict[str, Any]]) -> None:
    runs = []
    for cut_s in (0.010, 0.002, 0.001):
        world = World.from_rig(ur5e(joint_repeatability_rad=3e-6), q_rad=START_RAD, hidden=ALL)
        rows = []
        for block in range(60):
            world.command(course_rad(0.010 * block))
            for part in range(round(0.010 / cut_s)):
                world.advance(0.010 * block + cut_s * (part + 1))
            rows.append(np.concatenate((world.joints().q_rad, world.joints().torque_nm)))
        runs.append(np.array(rows))
    np.testing.assert_array_equal(runs[1], runs[0])
    np.testing.assert_array_equal(runs[2], runs[0])


@pytest.mark.parametrize("friction_nm", [0.5, 4.0, 25.0])
def test_friction_lags_the_arm_and_lets_it_come_to_rest(
    ur5e: Callable[..., dict[str, Any]], friction_nm: float
) -> None:
    """On the smallest inertia of the arm; the drives of a wrist give 28 Nm."""
    rubbed, smooth = (
        World.from_rig(ur5e(), q_rad=START_RAD, hidden=hidden) for hidden in ((Coulomb(6, friction_nm),), ())
    )
    for world in (rubbed, smooth):
        for step in range(1, 500):
            world.command(START_RAD + np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.3 * 0.002 * step]))
            world.advance(0.002 * step)
    lag_rad = smooth.joints().q_rad[5] - rubbed.joints().q_rad[5]
    inertia_kg_m2 = smooth.mass_matrix_kg_m2(START_RAD)[5, 5] + 0.1
    assert lag_rad == pytest.approx(friction_nm / (150.0**2 * inertia_kg_m2), rel=0.05)  # of a servo without integrator
    rubbed.advance(400.0)
    assert rubbed.stands
    assert rubbed.joints().q_rad[5] == pytest.approx(0.3 * 0.998, abs=1e-9)


def test_a_spring_holds_the_arm_off_its_set_point(ur5e: Callable[..., dict[str, Any]]) -> None:
    world = World.from_rig(ur5e(), q_rad=START_RAD, hidden=(JointSpring(6, 20.0, 0.5), LateTorque(6, 0.05)))
    world.advance(3.0)
    held_nm = world.joints().torque_nm[5] - world.load_nm(world.joints().q_rad, np.zeros(6))[5]
    assert world.stands
    assert held_nm == pytest.approx(20.0 * (world.joints().q_rad[5] - 0.5), rel=1e-6)
    assert START_RAD[5] < world.joints().q_rad[5] < START_RAD[5] + 0.01


def test_the_controller_works_with_the_masses_that_the_rig_states(ur5e: Callable[..., dict[str, Any]]) -> None:
    hidden = (HeavyRotor(2, 0.3), UnstatedPayload(2.0, (0.0, 0.0, 0.05)), LeaningGravity(0.02, 0.0))
    loaded, plain = (World.from_rig(ur5e(), q_rad=START_RAD, hidden=these) for these in (hidden, ()))
    np.testing.assert_array_equal(loaded.mass_matrix_kg_m2(START_RAD), plain.mass_matrix_kg_m2(START_RAD))
    np.testing.assert_array_equal(loaded.load_nm(START_RAD, np.ones(6)), plain.load_nm(START_RAD, np.ones(6)))
    assert np.abs(loaded.joints().torque_nm - plain.joints().torque_nm).max() > 5.0


def test_what_is_only_reported_moves_the_arm_by_not_one_bit(ur5e: Callable[..., dict[str, Any]]) -> None:
    reported, plain = Driven(ur5e(), (WrongTorqueConstant(2, 0.1), TorqueOffset(1, 1.0))), Driven(ur5e(), ())
    np.testing.assert_array_equal(reported.q, plain.q)
    np.testing.assert_array_equal(reported.qd, plain.qd)
    np.testing.assert_array_equal(reported.torque[:, 2:], plain.torque[:, 2:])
