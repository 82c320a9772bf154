"""Torques of a model as bodies and joints of MJCF: masses, rotors, friction, springs, gravity that leans.

What MJCF has no word for (load friction, ripple, delays and scales of what a robot reports) is stated in numbers.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.convert import corrected_parts
from calibrate.model.arms.inverse_dynamics import NUMBERS
from calibrate.model.effect_records import EffectRecord
from calibrate.model.effects.term import with_sigma
from calibrate.model.parameters import start_values
from calibrate.model.rigid import cross_matrix, inverse
from calibrate.model.torque_records import TorquesOfModel

Floats = NDArray[np.float64]

SMALL = 0.01  # of the trace of a tensor: not worth a word
LEAST_KG_M2 = 1e-6  # of the smallest inertia of a body, as `boundinertia` of the file


@dataclass(frozen=True)
class Body:
    """About its centre of mass, in the axes of the frame behind the turn of its joint."""

    mass_kg: float
    com_m: Floats  # (3,)
    inertia_kg_m2: Floats  # (6,) xx, yy, zz, xy, xz, yz


@dataclass(frozen=True)
class JointAttributes:
    """Of a hinge of MJCF, by its words: https://mujoco.readthedocs.io, XML reference, body/joint."""

    armature: float
    damping: float = 0.0
    frictionloss: float = 0.0
    stiffness: float = 0.0
    springref: float = 0.0

    @property
    def text(self) -> str:
        """Those that are not zero."""
        return "".join(f' {name}="{value!r}"' for name, value in vars(self).items() if value != 0.0)


@dataclass(frozen=True)
class MovingArm:
    """What MJCF takes of the torques of a model."""

    bodies: tuple[Body, ...]
    joints: tuple[JointAttributes, ...]
    gravity_m_s2: tuple[float, float, float]
    not_carried: tuple[str, ...] = field(default=())


def moving_arm(rig: Rig, torques: TorquesOfModel) -> MovingArm:
    """In the frames of an exported arm."""
    n, links = rig.n_joints, np.array(torques.links)
    hinges = [{"armature": rotor} for rotor in torques.rotors_kg_m2]
    gravity, left = np.array(torques.gravity_m_s2), list[str]()
    for effect in torques.effects:
        values = list(effect.coefficients.values())
        if effect.physics == "payload" and links[-1, 0] + values[0] > 0.0:
            links[-1, : len(values)] += values
        elif effect.physics == "gravity-direction":
            gravity = gravity + cross_matrix(np.array([*values, 0.0])) @ np.array(torques.gravity_m_s2)
        elif effect.physics in HINGE and HINGE[effect.physics](hinges[_joint(effect) - 1], values, torques, effect):
            continue
        else:
            left.append(_in_numbers(effect))
    joints = tuple(JointAttributes(**hinge) for hinge in hinges)
    made = [_body(T, link) for T, link in zip(_to_bodies(rig, n), links, strict=True)]
    bodies = tuple(body for body, _ in made)
    left += [
        f"Inertia of link {i} is larger by {short:.2g} kg m2 than that of the model, which no body has"
        for i, (body, short) in enumerate(made, start=1)
        if short > SMALL * float(np.sum(body.inertia_kg_m2[:3]))
    ]
    x, y, z = gravity.tolist()
    return MovingArm(bodies, joints, (x, y, z), (*torques.notes, *left))


def _joint(effect: EffectRecord) -> int:
    """From 1."""
    return int(effect.where.removeprefix("joint").removesuffix(".torque"))


Hinge = dict[str, float]


def _adds(word: str) -> Callable[[Hinge, list[float], TorquesOfModel, EffectRecord], bool]:
    def put(hinge: Hinge, values: list[float], torques: TorquesOfModel, effect: EffectRecord) -> bool:
        total = hinge.get(word, 0.0) + values[0]
        if total >= 0.0:
            hinge[word] = total
        return total >= 0.0

    return put


def _spring(hinge: Hinge, values: list[float], torques: TorquesOfModel, effect: EffectRecord) -> bool:
    """K (q - middle) + level = k (q - rest). MuJoCo has no springs that push on."""
    stiffness, level = values
    if stiffness <= 0.0:
        return False
    middle_rad = torques.middle_rad[_joint(effect) - 1] if torques.middle_rad else 0.0
    hinge["stiffness"], hinge["springref"] = stiffness, middle_rad - level / stiffness
    return True


HINGE: Mapping[str, Callable[[Hinge, list[float], TorquesOfModel, EffectRecord], bool]] = {
    "rotor-inertia": _adds("armature"),
    "viscous-friction": _adds("damping"),
    "coulomb-friction": _adds("frictionloss"),
    "joint-spring": _spring,
}


def _in_numbers(effect: EffectRecord) -> str:
    sizes = [f"{name} = {_size(one.value, one.sigma)}" for name, one in effect.parameters.items()]
    return f"Not in this file: {effect.physics} at {effect.where}: {', '.join(sizes)}"


def _size(value: float | None, sigma: float | None) -> str:
    return "not determined" if value is None else f"{value:.4g}" if sigma is None else with_sigma(value, sigma)


def _to_bodies(rig: Rig, n: int) -> list[Floats]:
    """(4, 4) of each link: from B_i, fixed to it, to the frame behind the turn of joint i in an exported arm."""
    arm = arm_of(rig)
    frames, out, behind = arm.frames(start_values(arm.parameters), np.zeros((1, n)))[0], list[Floats](), np.eye(4)
    for part, frame in zip(corrected_parts(rig.arm, {}), frames[1:], strict=False):
        behind = behind @ part  # at readings of zero an exported joint does not turn
        out.append(inverse(behind) @ frame)
    return out


def _body(T_body_link: Floats, link: Floats) -> tuple[Body, float]:
    """And by how much its inertia had to be made larger, kg m²."""
    mass, R = float(link[0]), T_body_link[:3, :3]
    centre = link[1 : len(NUMBERS) - 6] / mass
    xx, yy, zz, xy, xz, yz = link[4:]
    about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) + mass * cross_matrix(centre) @ cross_matrix(centre)
    w = np.linalg.eigvalsh(about)
    short = LEAST_KG_M2 + max(0.0, -float(w[0]), float(w[2] - w[1] - w[0]))
    turned = R @ about @ R.T + short * np.eye(3)  # points, rods and plates are no bodies to MuJoCo
    return Body(mass, R @ centre + T_body_link[:3, 3], turned[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]), short
