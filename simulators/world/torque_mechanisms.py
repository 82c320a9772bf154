"""Mechanisms of `simulators.defects.torque` at work in the moving world, in every physics step.

Masses belong to the body, and the servo knows them as it knows all others; friction, springs and ripple are torques
that it has to overcome with its position error. What it does not imitate: the wrench of a UR's force sensor is that of
the masses that the rig states.
"""

import math
from collections import deque
from collections.abc import Sequence

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from simulators.defects.defect import ChangesMasses, Defect, Masses, PullsAtJoint, ReportsTorque, RubsAtJoint, Shafts
from simulators.world.model import STEP_S, STEPS_PER_COMMAND
from simulators.world.rig import WorldRig

Floats = NDArray[np.float64]
SAME_NM = 1e-9  # torques of an arm that stands: rounding of some 100 Nm is far below


class TorqueMechanisms:
    """What acts on the joints, and what is reported of their torque; vectors are (n,)."""

    def __init__(self, defects: Sequence[Defect], n_joints: int) -> None:
        self._rubbing = [d for d in defects if isinstance(d, RubsAtJoint)]
        self._pulling = [d for d in defects if isinstance(d, PullsAtJoint)]
        self._reporting = [d for d in defects if isinstance(d, ReportsTorque)]
        late_s = max((float(getattr(d, "late_s", 0.0)) for d in self._reporting), default=0.0)
        self._given_nm: deque[Floats] = deque(maxlen=math.ceil(late_s / STEP_S) + STEPS_PER_COMMAND)
        self._none: Floats = np.zeros(n_joints)

    @property
    def acting(self) -> bool:
        """The servo has something to overcome."""
        return bool(self._rubbing or self._pulling)

    @property
    def settled(self) -> bool:
        """What is reported stays as it is while the arm stands."""
        return float(np.abs(self._given_nm[0] - self._given_nm[-1]).max()) < SAME_NM

    def felt_nm(self, shafts: Shafts) -> tuple[Floats, Floats]:
        """Friction, and what pulls beside it."""
        friction_nm = sum((d.joint_friction_nm(shafts) for d in self._rubbing), self._none)
        return friction_nm, sum((d.joint_pull_nm(shafts) for d in self._pulling), self._none)

    def given(self, torque_nm: Floats) -> None:
        """The torques of the present step."""
        self._given_nm.append(torque_nm)

    def reported_nm(self) -> Floats:
        """Of the last cycle of the controller, in the mean."""
        given_nm = mean_of_cycles(self._given_nm)
        for defect in self._reporting:
            given_nm = defect.reported_torque_nm(given_nm, STEP_S)
        return given_nm[-1]


def mean_of_cycles(given_nm: Sequence[Floats]) -> Floats:
    """(step, n) of torques (step, n): each the mean of the cycle that ends with it.

    The set-point moves on once a cycle, and the servo answers in its first step more than in its last: a single step
    would show the acceleration wrong by a seventh. A current loop averages over its cycle, too.
    """
    given = np.array(given_nm)
    cycle = min(STEPS_PER_COMMAND, len(given))
    return np.mean([given[k : len(given) - cycle + 1 + k] for k in range(cycle)], axis=0)


def with_true_masses(rig: WorldRig, defects: Sequence[Defect]) -> WorldRig:
    """The rig with the rotors, the tool and the gravity that it truly has."""
    changing = [defect for defect in defects if isinstance(defect, ChangesMasses)]
    if not changing:
        return rig
    rotors = np.array([joint.rotor_inertia_kg_m2 for joint in rig.arm.joint])
    masses = Masses(rotors, rig.tool.mass_kg, rig.tool.com_m, rig.arm.gravity_m_s2)
    for defect in changing:
        masses = defect.true_masses(masses)
    joints = tuple(
        structs.replace(joint, rotor_inertia_kg_m2=rotor)
        for joint, rotor in zip(rig.arm.joint, masses.rotor_kg_m2.tolist(), strict=True)
    )
    arm = structs.replace(rig.arm, joint=joints, gravity_m_s2=masses.gravity_m_s2)
    tool = structs.replace(rig.tool, mass_kg=masses.tool_kg, com_m=masses.tool_com_m)
    return structs.replace(rig, arm=arm, tool=tool)
