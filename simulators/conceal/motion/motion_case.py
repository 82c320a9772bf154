"""Draws the arm of a recorded motion: the stated rig, the true one, what is hidden, how noisy it records.

Sizes are those of machines, as shares of what the drive of a joint can give: a wrist has not the friction of a
shoulder. The true masses lie about those stated by the [tolerance] of the rig file.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simulators.conceal.rigs import ARMS, drawn
from simulators.conceal.wanted import ConcealError, Wanted
from simulators.defects import Defect, torque
from simulators.defects.outside_torque import BentSeal, ShortHose, WornOutputWheel
from simulators.ur.readout import TORQUE_PER_CURRENT_NM_A
from simulators.world.model import inertia_kg_m2

Floats = NDArray[np.float64]
ARMS_IN_MOTION = ("ur5e", "kr6", "iiwa7")
MASS_SHARE, COM_M, ROTOR_SHARE = 0.02, 2e-3, 0.01  # one sigma of what CAD knows of a link, and of a weighed rotor
GEOMETRY = {  # of an arm that has been calibrated and mastered
    "length_sigma_m": 2e-4,
    "angle_sigma_rad": 3e-4,
    "joint_zero_max_rad": 3e-4,
    "joint_repeatability_rad": 3e-6,
}
TORQUE_NOISE = (5e-4, 5e-3)  # of a reading, as a share of the largest torque
ANGLE_NOISE_RAD = (1e-6, 1e-5)
TOOL_KG = (0.3, 1.0)


@dataclass(frozen=True, eq=False)
class MotionCase:
    """Before anything moves."""

    wanted: Wanted
    stated: Mapping[str, Any]  # the rig file of the site
    true: Mapping[str, Any]  # that of the world
    hidden: tuple[Defect, ...]
    drive_nm: Floats  # (n,)
    torque_sigma_nm: Floats  # (n,) of a reading
    angle_sigma_rad: float

    @property
    def per_ampere(self) -> Floats | None:
        """(n,) torque of one ampere, where the controller reports currents."""
        joints = self.stated["arm"]["joint"]
        return np.array([j["torque_per_ampere"] for j in joints]) if "torque_per_ampere" in joints[0] else None


@dataclass(frozen=True)
class At:
    """One joint that something is drawn for."""

    joint: int
    drive_nm: float
    ratio: float
    rotor_kg_m2: float
    middle_rad: float
    rng: np.random.Generator

    def share(self, low: float, high: float) -> float:
        """Of the largest torque, in even steps of its logarithm."""
        return self.drive_nm * self.between(low, high)

    def between(self, low: float, high: float) -> float:
        return float(np.exp(self.rng.uniform(np.log(low), np.log(high))))

    @property
    def sign(self) -> float:
        return float(self.rng.choice((-1.0, 1.0)))

    @property
    def phase_rad(self) -> float:
        return float(self.rng.uniform(-np.pi, np.pi))


LISTED: dict[str, Callable[[At], Defect]] = {
    "coulomb": lambda at: torque.Coulomb(at.joint, at.share(0.007, 0.06)),
    "viscous": lambda at: torque.Viscous(at.joint, at.share(0.015, 0.2)),
    "stribeck": lambda at: torque.Stribeck(at.joint, at.share(0.01, 0.04), at.between(0.03, 0.15)),
    "load-friction": lambda at: torque.LoadFriction(at.joint, at.between(0.03, 0.2)),
    "joint-spring": lambda at: torque.JointSpring(at.joint, at.share(0.01, 0.08), at.middle_rad + at.phase_rad / 6.0),
    "gear-ripple": lambda at: torque.GearRipple(at.joint, at.share(0.003, 0.03), int(at.rng.integers(1, 3)), at.ratio),
    "heavy-rotor": lambda at: torque.HeavyRotor(at.joint, at.rotor_kg_m2 * at.between(0.1, 0.3)),
    "unstated-payload": lambda at: torque.UnstatedPayload(
        at.between(0.1, 3.0), (at.phase_rad / 60.0, at.phase_rad / 60.0, float(at.rng.uniform(0.0, 0.1)))
    ),
    "leaning-gravity": lambda at: _leaning(at.between(1e-3, 20e-3), at.phase_rad),
    "wrong-torque-constant": lambda at: torque.WrongTorqueConstant(at.joint, at.sign * at.between(0.02, 0.1)),
    "torque-offset": lambda at: torque.TorqueOffset(at.joint, at.sign * at.share(0.004, 0.03)),
    "late-torque": lambda at: torque.LateTorque(at.joint, at.between(1e-3, 20e-3)),
}
UNLISTED: dict[str, Callable[[At], Defect]] = {
    "outside-bent-seal": lambda at: BentSeal(at.joint, at.share(0.03, 0.08), at.phase_rad),
    "outside-short-hose": lambda at: ShortHose(at.joint, at.share(0.1, 0.3), at.middle_rad + at.phase_rad / 12.0),
    "outside-worn-output-wheel": lambda at: WornOutputWheel(at.joint, at.share(0.01, 0.04), at.phase_rad),
}


def _leaning(by_rad: float, towards_rad: float) -> Defect:
    return torque.LeaningGravity(by_rad * float(np.cos(towards_rad)), by_rad * float(np.sin(towards_rad)))


def draw_motion(wanted: Wanted) -> MotionCase:
    """All from the seed. ConcealError for an arm or a mechanism that is not drawn for motions."""
    if wanted.arm not in ARMS_IN_MOTION:
        raise ConcealError(f"arm '{wanted.arm}': no motion is drawn of it; there are {', '.join(ARMS_IN_MOTION)}")
    rig_rng, hide_rng, noise_rng = (np.random.default_rng([wanted.seed, stream]) for stream in (31, 32, 33))
    stated = _stated(wanted.arm, rig_rng)
    drive_nm = np.array(ARMS[wanted.arm]["drive_nm"])
    noise = float(np.exp(noise_rng.uniform(*np.log(TORQUE_NOISE))))
    return MotionCase(
        wanted,
        stated,
        _true(stated, rig_rng),
        _hidden(wanted, stated, drive_nm, hide_rng),
        drive_nm,
        noise * drive_nm,
        float(np.exp(noise_rng.uniform(*np.log(ANGLE_NOISE_RAD)))),
    )


def _stated(name: str, rng: np.random.Generator) -> dict[str, Any]:
    arm, drawing = ARMS[name], drawn(name)
    joints = [
        {
            "a_m": row.a_m,
            "alpha_rad": row.alpha_rad,
            "d_m": row.d_m,
            "theta_offset_rad": row.theta_offset_rad,
            "lower_rad": drawing.lower_rad[i],
            "upper_rad": drawing.upper_rad[i],
            "gear_ratio": drawing.gear_ratio[i],
            "mass_kg": drawing.mass_kg[i],
            "com_m": list(drawing.com_m[i]),
            "inertia_kg_m2": [inertia_kg_m2(drawing.mass_kg[i], float(np.hypot(row.a_m, row.d_m)))] * 3 + [0.0] * 3,
            "rotor_inertia_kg_m2": arm["rotor_kg_m2"][i],
        }
        for i, row in enumerate(drawing.rows)
    ]
    if name == "ur5e":  # its controller reports currents
        for joint, per_ampere in zip(joints, TORQUE_PER_CURRENT_NM_A, strict=True):
            joint["torque_per_ampere"] = per_ampere
    tool = {
        "mass_kg": float(rng.uniform(*TOOL_KG)),
        "com_m": [*rng.uniform(-0.02, 0.02, 2).tolist(), float(rng.uniform(0.02, 0.06))],
        "point_m": [0.0, 0.0, 0.1],
    }
    return {
        "schema": 1,
        "name": name,
        "arm": {"model": drawing.model, "gravity_m_s2": [0.0, 0.0, -9.81], "joint": joints},
        "tool": tool,
        "tolerance": {
            "length_m": GEOMETRY["length_sigma_m"],
            "angle_rad": GEOMETRY["angle_sigma_rad"],
            "mass_share": MASS_SHARE,
            "com_m": COM_M,
        },
    }


def _true(stated: Mapping[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """The rig file with the masses that its links truly have, and how far its geometry lies off."""
    joints = [
        {
            **joint,
            "mass_kg": joint["mass_kg"] * _within(MASS_SHARE, rng),
            "com_m": (np.array(joint["com_m"]) + COM_M * rng.standard_normal(3)).tolist(),
            "rotor_inertia_kg_m2": joint["rotor_inertia_kg_m2"] * _within(ROTOR_SHARE, rng),
        }
        for joint in stated["arm"]["joint"]
    ]
    arm = {**stated["arm"], "joint": joints}
    devices = {"robot": {"driver": "ur", "host": "auto"}}
    return {**stated, "arm": arm, "devices": devices, "emulation": dict(GEOMETRY)}


def _within(share: float, rng: np.random.Generator) -> float:
    return 1.0 + share * float(np.clip(rng.standard_normal(), -2.5, 2.5))


def _hidden(
    wanted: Wanted, stated: Mapping[str, Any], drive_nm: Floats, rng: np.random.Generator
) -> tuple[Defect, ...]:
    """As many as asked for, none of a kind and a joint twice."""
    out: list[Defect] = []
    for name in wanted.defects:
        among: Sequence[str] = (
            tuple(UNLISTED if name == "outside" else LISTED) if name in ("any", "outside") else (name,)
        )
        kinds = [kind for kind in among if kind not in {one.KIND for one in out}]
        kind = kinds[int(rng.integers(len(kinds)))] if kinds else ""
        make = (LISTED | UNLISTED).get(kind) if kinds else None
        if make is None:
            names = ", ".join((*LISTED, *UNLISTED))
            raise ConcealError(f"defect '{name}': no torque of a motion, or asked for twice; there are {names}")
        out.append(make(_at(int(rng.integers(len(drive_nm))), stated, drive_nm, rng)))
    return tuple(out)


def _at(index: int, stated: Mapping[str, Any], drive_nm: Floats, rng: np.random.Generator) -> At:
    joint = stated["arm"]["joint"][index]
    middle_rad = 0.5 * (joint["lower_rad"] + joint["upper_rad"])
    rotor_kg_m2 = joint["rotor_inertia_kg_m2"]
    return At(index + 1, float(drive_nm[index]), joint["gear_ratio"], rotor_kg_m2, middle_rad, rng)
