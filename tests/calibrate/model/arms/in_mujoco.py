"""A rigid arm as a MuJoCo model, its links given by their ten inertial numbers."""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation


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
