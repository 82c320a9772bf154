"""The arm whose errors are simulated, and the effect of drawn errors on its probe at a pose.

Fixed parts with turns between them, and the probe behind the last one. Any serial arm is one
(calibrate/model/arms/serial.py), so that a robot's D-H table and the local product of exponentials of an arm CMM are
perturbed in the same way: six errors behind every fixed part, one at every joint angle. Source: Huang Kui et al., error
simulation of a flexible arm coordinate measuring machine, eq. 1 to 3.

Slot 7 i + c (c = 0 ... 5) perturbs part i by a shift and a rotation vector in the frame behind it, slot 7 i + 6 adds to
the angle of joint i + 1 (model/arms/compiled.py). A column is what is drawn of an arm; at a pose a slot is a sum of
columns by weights. A phased source has two columns, size times cosine and size times sine of its phase.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.sparse import csr_array

from acquisition.recording.rig import Rig
from calibrate.error_simulation.sources import ErrorSource, Law
from calibrate.model.arms.compiled import PER_PART, perturbed_points
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.model_file import ModelFile
from calibrate.model.predict import rig_of_model
from calibrate.model.rigid import cross

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Machine(RigArm):
    """Nominal or as identified; the probe is its tool's point."""

    name: str

    def by_slot(self, q_rad: Floats) -> Floats:
        """(pose, 3, slot) derivative of the probe by every slot (calibrate/model/arms/compiled.py), at no error.

        Shift c of part i moves it by the axis c of B_i, turn c by that axis x (p - o); an angle is a turn about z.
        """
        B = self.frames(q_rad)
        lever = (B[:, -1, :3, :3] @ self.point_m + B[:, -1, :3, 3])[:, None] - B[..., :3, 3]  # (pose, part, 3)
        axes = np.swapaxes(B[..., :3, :3], -1, -2)  # (pose, part, axis, 3)
        turns = cross(axes, np.broadcast_to(lever[:, :, None], axes.shape))
        by = np.concatenate([axes, turns, turns[:, :, 2:]], axis=2)  # (pose, part, 7, 3)
        return np.swapaxes(by.reshape(len(q_rad), -1, 3), 1, 2)

    def drawn_poses(self, count: int, rng: Generator) -> Floats:
        """(pose, joint) readings, evenly between the limits."""
        return rng.uniform(self.lower_rad, self.upper_rad, (count, self.n_joints))


def slot(part: int, component: int) -> int:
    """Number of a slot: components 0 to 5 of a fixed part, 6 for the angle of the joint behind it."""
    return PER_PART * part + component


def machine_of(
    rig: Rig, values: Mapping[str, float] | None = None, about_tool_m: tuple[float, ...] | None = None
) -> Machine:
    """The rig's arm, with `values` of its parameters by name.

    The probe is at `about_tool_m`, else at tool.point_m, else at the flange's origin; `values` of the tool correct it.
    """
    arm = RigArm.of_rig(rig, values)
    shift = [(values or {}).get(f"tool.{axis}", 0.0) for axis in ("x", "y", "z")]
    point = np.array((about_tool_m or rig.tool.point_m or (0.0, 0.0, 0.0))[:3]) + shift
    return Machine(**{**vars(arm), "point_m": point}, name=rig.name)


def identified_machine(model: ModelFile) -> tuple[Machine, Rig]:
    """The arm of a model file as identified, and its rig. DataError for a file without its rig."""
    rig = rig_of_model(model)
    return machine_of(rig, model.chain, model.about.get("tool")), rig


Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Columns:
    """`of_source` (source, 2): the column of each source's value, or of its cosine and its sine; -1 for none."""

    laws: tuple[Law, ...]  # of each source
    of_source: Ints

    @property
    def count(self) -> int:
        return int(np.count_nonzero(self.of_source >= 0))

    def draw(self, rng: np.random.Generator, arms: int) -> Floats:
        """(column, arm)"""
        out = np.empty((self.count, arms))
        for law, (own, other) in zip(self.laws, self.of_source.tolist(), strict=True):
            out[own] = law.draw(rng, arms)
            if other >= 0:
                half = np.tan(np.pi * rng.random(arms))  # of a phase anywhere in a turn; several times faster than sin
                share = out[own] / (1.0 + half * half)
                out[other] = 2.0 * half * share
                out[own] = (1.0 - half * half) * share
        return out


@dataclass(frozen=True)
class ArmAtPoses:
    """The nominal arm at some poses, and the weights of columns in slots there."""

    fixed: Floats  # (joint + 1, 4, 4)
    angle_rad: Floats  # (pose, joint), offsets added
    point_m: Floats  # (3,) of the probe behind the last part
    slots: Ints  # (term,)
    columns: Ints  # (term,)
    weights: Floats  # (pose, term)

    @property
    def moved(self) -> NDArray[np.bool_]:
        """(part,) whether any term perturbs it, other than by the joint behind it."""
        out = np.zeros(len(self.fixed), dtype=np.bool_)
        out[self.slots[self.slots % PER_PART < PER_PART - 1] // PER_PART] = True
        return out

    def probes_m(self, pose: int, columns: Floats) -> Floats:
        """(3, arm) in the base, for columns (column, arm)."""
        places = self.slots, self.columns
        weights = csr_array((self.weights[pose], places), shape=(PER_PART * len(self.fixed), len(columns)))
        return perturbed_points(self.fixed, self.angle_rad[pose], self.point_m, self.moved, weights @ columns)

    def nominal_m(self) -> Floats:
        """(pose, 3) where the probe is without any error, by the same loops."""
        nothing = np.zeros((int(self.columns.max(initial=0)) + 1, 1))
        return np.stack([self.probes_m(pose, nothing)[:, 0] for pose in range(len(self.angle_rad))])


def columns_of(sources: Sequence[ErrorSource]) -> Columns:
    """Values in the order of the sources, then the second columns of phased ones."""
    of_source = np.full((len(sources), 2), -1)
    of_source[:, 0] = np.arange(len(sources))
    phased = [i for i, source in enumerate(sources) if source.phased]
    of_source[phased, 1] = len(sources) + np.arange(len(phased))
    return Columns(tuple(source.law for source in sources), of_source)


def arm_at(machine: Machine, sources: Sequence[ErrorSource], columns: Columns, q_rad: Floats) -> ArmAtPoses:
    """The machine at readings (pose, joint), with every term of every source."""
    slots, index, weights = list[int](), list[int](), list[Floats]()
    for source, own in zip(sources, columns.of_source.tolist(), strict=True):
        for term in source.terms:
            for column, weight in zip(own, term.weights(q_rad).T, strict=True):
                if column >= 0:
                    slots.append(term.slot)
                    index.append(column)
                    weights.append(weight)
    return ArmAtPoses(
        machine.fixed,
        machine.angles_rad(q_rad),
        machine.point_m,
        np.array(slots, dtype=np.int64),
        np.array(index, dtype=np.int64),
        np.ascontiguousarray(np.stack(weights, axis=1)),
    )


def probe_errors(arm: ArmAtPoses, pose: int, columns: Floats, nominal_m: Floats) -> Floats:
    """(arm, 3) m of given columns (arm, column), at one of the poses."""
    return (arm.probes_m(pose, np.ascontiguousarray(columns.T)) - nominal_m[:, None]).T
