"""A UR5e in motion, by MuJoCo's inverse dynamics, with mechanisms that are put in by plain laws, for tests."""

from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from acquisition.recording import Channel, Recording, Samples, Stream
from acquisition.recording.rig import load_rig
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.parameters import start_values

RIG = Path(__file__).parents[1] / "rigs" / "ur5e-tracker.toml"
ROTOR_KG_M2 = 0.1
RATE_HZ = 500.0
ANGLE_NOISE_RAD, TORQUE_NOISE_NM = 2e-6, 0.1


@dataclass(frozen=True)
class Hidden:
    """Per joint (from 1) unless said otherwise, in Nm, rad, s, kg."""

    coulomb: dict | None = None
    viscous: dict | None = None
    rotor: dict | None = None
    spring: dict | None = None
    scale: dict | None = None
    offset: dict | None = None
    delay: dict | None = None
    loaded: dict | None = None
    payload_kg: float = 0.0
    lean_rad: tuple = (0.0, 0.0)


def numbers(values):
    return " ".join(repr(float(v)) for v in values)


def in_mujoco(frames_at_zero, links, gravity, joint=lambda number: ""):
    """The arm with its links (link, 10) as bodies at the frames of one posture, hinges about z of the frame in front.

    `joint`: more attributes of the hinge of a joint, from 1.
    """
    text = f'<mujoco><compiler angle="radian" inertiafromgeom="false"/><option gravity="{numbers(gravity)}">'
    text += '<flag contact="disable"/></option><worldbody>'
    for i, (before, behind, link) in enumerate(
        zip(frames_at_zero[:-1], frames_at_zero[1:], links, strict=True), start=1
    ):
        # The body is B_i at this posture; its hinge stands in B_(i-1).
        parent = np.eye(4) if i == 1 else frames_at_zero[i - 1]
        pose = np.linalg.inv(parent) @ behind
        hinge = np.linalg.inv(behind) @ before
        mass, centre = link[0], link[1:4] / link[0]
        tensor = np.array([[link[4], link[7], link[8]], [link[7], link[5], link[9]], [link[8], link[9], link[6]]])
        own = tensor - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        x, y, z, w = Rotation.from_matrix(pose[:3, :3]).as_quat()
        text += (
            f'<body pos="{numbers(pose[:3, 3])}" quat="{numbers((w, x, y, z))}">'
            f'<joint type="hinge" pos="{numbers(hinge[:3, 3])}" axis="{numbers(hinge[:3, 2])}" {joint(i)}/>'
            f'<inertial pos="{numbers(centre)}" mass="{float(mass)!r}" fullinertia="'
            f'{numbers(own[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])}"/>'
        )
    return mujoco.MjModel.from_xml_string(text + "</body>" * len(links) + "</worldbody></mujoco>")


def of(table, n):
    out = np.zeros(n)
    for joint, value in (table or {}).items():
        out[joint - 1] = value
    return out


def rig_of_test():
    """With rotors and tensors stated."""
    rig = load_rig(RIG)
    joints = tuple(
        msgspec.structs.replace(joint, rotor_inertia_kg_m2=ROTOR_KG_M2, inertia_kg_m2=ball(joint.mass_kg))
        for joint in rig.arm.joints
    )
    return msgspec.structs.replace(rig, arm=msgspec.structs.replace(rig.arm, joints=joints))


def ball(mass_kg):
    return (0.02 * mass_kg,) * 3 + (0.0,) * 3


def links_of(rig):
    """(link, 10) of the masses that the rig states, each a ball about its centre; the tool is part of the last link."""
    out = np.zeros((rig.n_joints, 10))
    bodies = [(i, j.mass_kg, j.com_m) for i, j in enumerate(rig.arm.joints)]
    bodies.append((rig.n_joints - 1, rig.tool.mass_kg or 0.0, rig.tool.com_m or (0.0, 0.0, 0.0)))
    for link, mass, com in bodies:
        c = np.array(com)
        tensor = 0.02 * mass * np.eye(3) + mass * (c @ c * np.eye(3) - np.outer(c, c))
        out[link] += [mass, *(mass * c), *tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]]
    return out


def trajectory(n, length_s, rng):
    """Sines of joints that excite them all: angles, speeds, accelerations (sample, joint)."""
    t = np.arange(0.0, length_s, 1.0 / RATE_HZ)
    q, qd, qdd = np.zeros((3, len(t), n))
    for k in range(1, 6):
        w = 2.0 * np.pi * 0.1 * k
        size, phase = rng.normal(0.0, 0.35 / k**0.5, n), rng.uniform(0.0, 2.0 * np.pi, n)
        q += size * np.sin(w * t[:, None] + phase)
        qd += size * w * np.cos(w * t[:, None] + phase)
        qdd -= size * w**2 * np.sin(w * t[:, None] + phase)
    middle = np.array([0.0, -1.3, 1.5, -1.2, -1.3, 0.2])
    return t, q + middle, qd, qdd


def recorded(hidden, seed=1, length_s=20.0, noise_nm=TORQUE_NOISE_NM):
    """A recording of streams alone: joint angles and torques at 500 Hz, without any sample."""
    rng = np.random.default_rng(seed)
    rig = rig_of_test()
    arm, n = arm_of(rig), rig.n_joints
    t, q, qd, qdd = trajectory(n, length_s, rng)
    links = links_of(rig)
    links[-1, 0] += hidden.payload_kg
    rotors, springs, damping = ROTOR_KG_M2 + of(hidden.rotor, n), of(hidden.spring, n), of(hidden.viscous, n)
    lean = np.array([*hidden.lean_rad, 0.0])
    gravity = np.array(rig.arm.gravity_m_s2)
    model = in_mujoco(
        arm.frames(start_values(arm.parameters), np.zeros((1, n)))[0],
        links,
        gravity + np.cross(lean, gravity),
        lambda i: (
            f'armature="{numbers([rotors[i - 1]])}" stiffness="{numbers([springs[i - 1]])}" '
            f'damping="{numbers([damping[i - 1]])}"'
        ),
    )
    data, torque = mujoco.MjData(model), np.zeros_like(q)
    for row in range(len(t)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[row], qd[row], qdd[row]
        mujoco.mj_inverse(model, data)
        torque[row] = data.qfrc_inverse
    torque = torque + of(hidden.coulomb, n) * np.sign(qd) + of(hidden.loaded, n) * np.abs(torque) * np.sign(qd)
    torque = torque * (1.0 + of(hidden.scale, n)) + of(hidden.offset, n)
    late = of(hidden.delay, n)
    torque = np.stack([np.interp(t - late[j], t, torque[:, j]) for j in range(n)], axis=1)
    q = q + ANGLE_NOISE_RAD * rng.standard_normal(q.shape)
    torque = torque + noise_nm * rng.standard_normal(torque.shape)
    channels = (Channel("actual_q_rad", "rad", (n,)), Channel("joint_torque_nm", "Nm", (n,)))
    values = {"actual_q_rad": q, "joint_torque_nm": torque}
    stream = Stream("robot", channels, t, t, np.arange(len(t)), values)
    return Recording(Path("motion"), "", rig, Samples({"t_s": np.zeros(0)}, n), True, streams={"robot": stream})


def with_more(recording, joint, law):
    """With `law` of the angle and the speed of a joint (from 1) added to its torque; Nm, rad, rad/s."""
    stream = recording.streams["robot"]
    angle, torque = stream.values["actual_q_rad"][:, joint - 1], stream.values["joint_torque_nm"].copy()
    torque[:, joint - 1] += law(angle, np.gradient(angle, 1.0 / RATE_HZ))
    values = {**stream.values, "joint_torque_nm": torque}
    return replace(recording, streams={"robot": replace(stream, values=values)})
