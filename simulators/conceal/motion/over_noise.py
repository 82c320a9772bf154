"""How large a hidden torque is against the noise, after what the tolerances of the rig file could take of it.

The effect of a mechanism is the reported torque with all that is hidden, less that without this one, along the motion
that was recorded. Its unit is the noise of a torque averaged over a moment of 25 ms, in which an arm hardly moves; all
joints count together, as the three axes of a position do.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from msgspec import structs
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from simulators.conceal.motion.driving import Moved
from simulators.conceal.motion.motion_case import COM_M, MASS_SHARE, ROTOR_SHARE, MotionCase
from simulators.defects import Defect
from simulators.defects.defect import ChangesMasses, PullsAtJoint, ReportsTorque, RubsAtJoint, Shafts
from simulators.world.model import build_mjcf
from simulators.world.rig import WorldRig, read_rig
from simulators.world.servo import Engine
from simulators.world.torque_mechanisms import with_true_masses
from simulators.world.truth import draw_truth

Floats = NDArray[np.float64]
MOMENT_S = 0.025
SLOPE_S = 0.1  # window of a parabola through the angles
ROWS_PER_MOMENT = 5
LOAD_TURNS = 3  # friction by load is a share of the torque that it is part of
WEIGHED_EVERY = 6  # moments: torques of links change slowly


class TorquesOnTheWay:
    """Torques of the true arm along a motion."""

    def __init__(self, case: MotionCase, moved: Moved) -> None:
        step_s = float(np.median(np.diff(moved.time_s)))
        window = 2 * round(0.5 * SLOPE_S / step_s) + 1
        each = max(1, round(MOMENT_S / ROWS_PER_MOMENT / step_s))
        self.step_s, self.rows_per_moment = each * step_s, MOMENT_S / (each * step_s)
        self.q_rad, self.qd_rad_s, self.qdd_rad_s2 = (
            np.asarray(savgol_filter(moved.q_rad, window, 3, deriv=order, delta=step_s, axis=0))[::each]
            for order in range(3)
        )
        self._rig = read_rig(case.true)
        self._truth = draw_truth(self._rig, case.wanted.seed)
        self._case = case
        self._links: dict[tuple[Defect, ...], Floats] = {}

    def reported_nm(self, defects: Sequence[Defect]) -> Floats:
        """(row, n) with these at work."""
        heavy = tuple(defect for defect in defects if isinstance(defect, ChangesMasses))
        if heavy not in self._links:
            self._links[heavy] = self.of_links(with_true_masses(self._rig, heavy), np.arange(len(self.q_rad)))
        links = self._links[heavy]
        given = np.stack([self._given(row, links[row], defects) for row in range(len(links))])
        for defect in defects:
            if isinstance(defect, ReportsTorque):
                given = defect.reported_torque_nm(given, self.step_s)
        return given

    def _given(self, row: int, links_nm: Floats, defects: Sequence[Defect]) -> Floats:
        shafts = Shafts(self.q_rad[row], self.qd_rad_s[row], links_nm)
        pulled = links_nm + sum(d.joint_pull_nm(shafts) for d in defects if isinstance(d, PullsAtJoint))
        rubbing, given = [d for d in defects if isinstance(d, RubsAtJoint)], pulled
        for _ in range(LOAD_TURNS if rubbing else 0):
            given = pulled + sum(d.joint_friction_nm(replace(shafts, torque_nm=given)) for d in rubbing)
        return given

    def of_links(self, rig: WorldRig, rows: NDArray[np.intp]) -> Floats:
        """(row, n) of links, tool and rotors."""
        engine = Engine(build_mjcf(rig, self._truth))
        n = len(rig.arm.joint)
        at, dofs = engine.joint_addresses([f"joint{i}" for i in range(1, n + 1)])
        rotors = np.array([joint.rotor_inertia_kg_m2 for joint in rig.arm.joint])
        qpos, qvel, out = np.zeros(n), np.zeros(n), np.empty((len(rows), n))
        for k, row in enumerate(rows):
            qpos[at], qvel[dofs] = self.q_rad[row] + self._truth.joint_zero_rad, self.qd_rad_s[row]
            accelerated = engine.inertia_at(qpos)[np.ix_(dofs, dofs)] @ self.qdd_rad_s2[row]
            out[k] = accelerated + rotors * self.qdd_rad_s2[row] + engine.bias_at(qpos, qvel)[dofs]
        return out

    def of_tolerances(self, rows: NDArray[np.intp]) -> Floats:
        """(tolerance, row, n) by one sigma of each number of a link that is not known better."""
        rig, start = self._rig, self.of_links(self._rig, rows)
        ways = [self.of_links(_with_joint(rig, i, **change), rows) for i, change in _tolerances(rig)]
        return np.stack(ways) - start


def _tolerances(rig: WorldRig) -> list[tuple[int, dict[str, object]]]:
    out: list[tuple[int, dict[str, object]]] = []
    for i, joint in enumerate(rig.arm.joint):
        out.append((i, {"mass_kg": joint.mass_kg * (1.0 + MASS_SHARE)}))
        out.append((i, {"rotor_inertia_kg_m2": joint.rotor_inertia_kg_m2 * (1.0 + ROTOR_SHARE)}))
        out.extend((i, {"com_m": tuple((np.array(joint.com_m) + COM_M * axis).tolist())}) for axis in np.eye(3))
    return out


def _with_joint(rig: WorldRig, index: int, **change: object) -> WorldRig:
    joints = tuple(structs.replace(j, **change) if i == index else j for i, j in enumerate(rig.arm.joint))
    return structs.replace(rig, arm=structs.replace(rig.arm, joint=joints))


def over_noise(case: MotionCase, moved: Moved) -> list[float]:
    """Of each hidden mechanism, in its order: rms over the moments."""
    if not case.hidden:
        return []
    of = TorquesOnTheWay(case, moved)
    whole = of.reported_nm(case.hidden)
    step_s = float(np.median(np.diff(moved.time_s)))
    noise_nm = case.torque_sigma_nm * np.sqrt(step_s / MOMENT_S)
    rows = np.arange(0, len(whole), max(1, round(WEIGHED_EVERY * of.rows_per_moment)))
    ways = (of.of_tolerances(rows) / noise_nm).reshape(-1, rows.size * len(noise_nm)).T
    moments = len(whole) / of.rows_per_moment
    out: list[float] = []
    for one in case.hidden:
        effect = (whole - of.reported_nm([d for d in case.hidden if d is not one])) / noise_nm
        out.append(_after(ways, effect[rows].ravel(), moments / rows.size, moments))
    return out


def _after(ways: Floats, effect: Floats, weight: float, moments: float) -> float:
    """What the tolerances do not take, each at the price of its own sigma."""
    w = np.sqrt(weight)
    whole = np.concatenate([w * ways, np.eye(ways.shape[1])])
    wanted = np.concatenate([w * effect, np.zeros(ways.shape[1])])
    found, *_ = np.linalg.lstsq(whole, wanted, rcond=None)
    return float(np.linalg.norm(wanted - whole @ found) / np.sqrt(moments))
