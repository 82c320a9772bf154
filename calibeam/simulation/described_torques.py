"""A URDF or MJCF file as the simulation of a motion: what it states of links, rotors, friction, springs and gravity.

Source: MuJoCo documentation, XML reference, joint (armature, damping, frictionloss, stiffness, springref), and
computation, passive forces. Ten numbers of a link as calibrate/model/arms/inverse_dynamics.py has them.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.files import shown
from acquisition.recording.rig import Rig
from calibeam.simulation.described_arm import DescribedArm, described_arm
from calibrate.model.effect_records import EffectParameter, EffectRecord
from calibrate.model.effects.torque import friction, masses_and_springs, torque_port
from calibrate.model.torque_records import TorquesOfModel

Floats = NDArray[np.float64]

TENSOR = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])  # xx, yy, zz, xy, xz, yz


def described_torques(path: Path, rig: Rig) -> TorquesOfModel:
    """What the file states, in the frames, senses and zeros of the rig.

    Gravity of a URDF file is that of the rig: the format has none. DataError naming file, place and remedy where the
    file cannot be read, or where its arm is not that of the rig.
    """
    arm = described_arm(path, rig)
    model, own = arm.model, [int(arm.model.jnt_dofadr[one]) for one in arm.joints]
    down = arm.T[:3, :3] @ (_unless(arm, "GRAVITY") * np.asarray(model.opt.gravity))
    gravity = np.array(rig.arm.gravity_m_s2) if arm.is_urdf else down
    effects = tuple(_effects(arm, own))
    springs = any(one.physics == masses_and_springs.SPRING.physics for one in effects)
    at_rest = arm.senses * np.array([model.qpos_spring[model.jnt_qposadr[one]] for one in arm.joints])
    return TorquesOfModel(
        source=path.name,
        links=tuple(tuple(row) for row in _links(arm).tolist()),
        rotors_kg_m2=tuple(np.asarray(model.dof_armature)[own].tolist()),
        gravity_m_s2=(float(gravity[0]), float(gravity[1]), float(gravity[2])),
        effects=effects,
        middle_rad=tuple(at_rest.tolist()) if springs else (),
        notes=tuple(_notes(arm, own)),
    )


def _unless(arm: DescribedArm, flag: str) -> float:
    """0 where the file switches a force off."""
    return 0.0 if int(arm.model.opt.disableflags) & int(getattr(arm.mujoco.mjtDisableBit, f"mjDSBL_{flag}")) else 1.0


def _links(arm: DescribedArm) -> Floats:
    """(link, 10) of all bodies that turn with each joint, about the origin of B_i and in its axes."""
    out = np.zeros((len(arm.joints), 10))
    for body, link in enumerate(arm.link):
        if link == 0:
            continue
        mass, B = float(arm.model.body_mass[body]), arm.frames[link]
        c, R = B[:3, :3].T @ (arm.centres_m[body] - B[:3, 3]), B[:3, :3].T @ arm.axes[body]
        tensor = R @ np.diag(arm.model.body_inertia[body]) @ R.T + mass * (c @ c * np.eye(3) - np.outer(c, c))
        out[link - 1] += [mass, *(mass * c), *tensor[TENSOR]]
    return out


def _effects(arm: DescribedArm, own: list[int]) -> Iterator[EffectRecord]:
    model, stiffness = arm.model, np.asarray(arm.model.jnt_stiffness)[list(arm.joints)]
    viscous = _unless(arm, "DAMPER") * np.asarray(model.dof_damping)[own]
    dry = _unless(arm, "FRICTIONLOSS") * np.asarray(model.dof_frictionloss)[own]
    for i, (grease, rubs, spring) in enumerate(zip(viscous, dry, _unless(arm, "SPRING") * stiffness, strict=True), 1):
        if grease > 0.0:
            yield _effect(i, friction.VISCOUS.physics, f"qd{i}", "linear", {"friction_nms_per_rad": grease})
        if rubs > 0.0:
            yield _effect(i, friction.COULOMB.physics, f"qd{i}", "sign", {"friction_nm": rubs})
        if spring > 0.0:
            sizes = {"stiffness_nm_per_rad": spring, "level_nm": 0.0}
            yield _effect(i, masses_and_springs.SPRING.physics, f"q{i}", "linear", sizes)


def _effect(joint: int, physics: str, driver: str, shape: str, sizes: dict[str, float]) -> EffectRecord:
    return EffectRecord(
        name=f"joint{joint}-{physics}",
        where=torque_port(joint).where,
        physics=physics,
        depends_on=driver,
        shape=shape,
        order=None,
        variant="",
        parameters={name: EffectParameter(float(size), None, _unit(name)) for name, size in sizes.items()},
        coefficients={name: float(size) for name, size in sizes.items()},
        inner={},
        about={},
        holds="always",
        range={},
    )


def _unit(name: str) -> str:
    return {"friction_nms_per_rad": "Nm s/rad", "stiffness_nm_per_rad": "Nm/rad"}.get(name, "Nm")


def _notes(arm: DescribedArm, own: list[int]) -> Iterator[str]:
    """How the file was read, and what of it takes no part."""
    if other := [arm.name(i) for i, sense in enumerate(arm.senses, start=1) if sense < 0.0]:
        yield f"These joints turn the other way in the file and were reversed: {shown(', '.join(other))}."
    yield "The zero of the last joint is taken from the file: axes do not show it."
    if arm.still:
        yield f"These joints of the file are no axes of the arm and are taken to stand: {shown(', '.join(arm.still))}."
    if left := [f"{what} ({count})" for what, count in _left_out(arm.model, own) if count]:
        yield f"Not taken from the file: {', '.join(left)}."


def _left_out(model: Any, own: list[int]) -> Iterator[tuple[str, int]]:
    count = np.count_nonzero
    yield "actuators", int(model.nu)
    yield "equality constraints", int(model.neq)
    yield "tendons", int(model.ntendon)
    yield "shapes that could touch", int(count(np.asarray(model.geom_contype) | np.asarray(model.geom_conaffinity)))
    yield "bodies with compensated gravity", int(count(model.body_gravcomp))
    yield "joints with damping of higher order", int(count(np.any(np.asarray(model.dof_dampingpoly)[own], axis=1)))
    yield "joints with stiffness of higher order", int(count(np.any(model.jnt_stiffnesspoly, axis=1)))
    yield "density or viscosity of the air", int(count([model.opt.density, model.opt.viscosity]))
