"""MuJoCo's own system identification (mujoco.sysid) on the torques of a recorded motion; only `make bench` installs it.

Its ready-made residuals compare rollouts from recorded controls. A robot under a servo shows torques and angles, and
a rollout of torques alone drifts away within a second; so the residual here is that of inverse dynamics, `mj_inverse`
at each measured moment, in its own `optimize` with its own `Parameter`s and modifiers. Weights are the true noise.

Dry friction of MuJoCo is a constraint on the acceleration that stops the joint within `solreffriction`. Its time is
made so short that the torque has the sense of the speed at every moment that counts.
"""

import contextlib
import importlib
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import Rig
from calibeam.prove.record import TrueDefect
from calibrate.apply.export import identified_arm
from calibrate.apply.export.robot_description import mjcf_text
from calibrate.diagnose.motion import torques_of_rig
from calibrate.diagnose.motion.motion_table import Motion

Floats = NDArray[np.float64]

IN_MJCF = {  # what a list of parameters can hold of each mechanism
    "coulomb-friction": ("frictionloss",),
    "viscous-friction": ("damping",),
    "rotor-inertia": ("armature",),
    "joint-spring": ("stiffness", "springref"),
    "payload": ("inertial",),
    "gravity-direction": ("lean",),
}
START = 0.01  # of the upper bound: on a bound the optimizer can stall
MOST_LEAN_RAD = 0.1
MOST_ROTOR = 10.0  # times the stated one
FRICTION_PER_S = 1e4  # of solreffriction, damping: the speed ends in 0.1 ms
MOST_ITERATIONS = 30  # later ones change the sum of squares by less than 0.01


def sysid() -> Any:
    """The module; SystemExit with the remedy where what it imports is missing."""
    module = importlib.import_module("mujoco.sysid")
    if not hasattr(module, "optimize"):
        raise SystemExit("motion_rivals compares with mujoco.sysid: run it by `make bench NAMES=motion_rivals`")
    return module


def spec_of(rig: Rig) -> mujoco.MjSpec:
    """The arm with masses and rotors as the rig file states them. ValueError where it states none."""
    torques = torques_of_rig(rig, rig.name)
    if torques is None:
        raise ValueError(f"rig {rig.name}: [[arm.joint]] mass_kg is missing; MuJoCo starts from stated masses")
    spec = mujoco.MjSpec.from_string(mjcf_text(replace(identified_arm(rig, {}), torques=torques)))
    for joint in spec.joints:
        joint.solref_friction = [-1.0, -FRICTION_PER_S]
        joint.limited = mujoco.mjtLimited.mjLIMITED_FALSE
    return spec


def inverse_nm(model: mujoco.MjModel, motion: Motion) -> Floats:
    """(moment, joint) torques of a model at the measured angles, speeds and accelerations."""
    data, out = mujoco.MjData(model), np.empty_like(motion.q_rad)
    for row, state in enumerate(zip(motion.q_rad, motion.qd_rad_s, motion.qdd_rad_s2, strict=True)):
        data.qpos[:], data.qvel[:], data.qacc[:] = state
        mujoco.mj_inverse(model, data)
        out[row] = data.qfrc_inverse
    return out


@dataclass(frozen=True, eq=False)
class SysidFit:
    """What mujoco.sysid has fitted to the seen part of a motion."""

    start: Any  # ParameterDict as the rig file states it
    found: Any  # ParameterDict
    model: mujoco.MjModel

    def figures(self, defect: TrueDefect, joints: int) -> dict[str, float] | None:
        """Sizes of a mechanism by the names of the truth; None where the list does not hold it."""
        keys = keys_of(defect, joints)
        if not keys or keys[0] not in self.found:
            return None
        values = self.found[keys[0]].value
        if defect.physics in ("rotor-inertia", "payload"):
            values = values - self.start[keys[0]].nominal
        return dict(zip(defect.figures, values.tolist(), strict=False))


def keys_of(defect: TrueDefect, joints: int) -> tuple[str, ...]:
    """Parameters that hold a mechanism; none where MJCF has no word for it."""
    place = {"tool.load": f"link{joints}", "base.lean": "gravity"}.get(defect.port, defect.port.split(".")[0])
    return tuple(f"{place}.{word}" for word in IN_MJCF.get(defect.physics, ()))


def every_key(joints: int) -> tuple[str, ...]:
    """Of all joints and bodies."""
    words = ("frictionloss", "damping", "armature", "stiffness", "springref")
    each = [(*(f"joint{i}.{word}" for word in words), f"link{i}.inertial") for i in range(1, joints + 1)]
    return (*(key for keys in each for key in keys), "gravity.lean")


def fitted(rig: Rig, seen: Motion, sigma_nm: Floats, keys: Sequence[str]) -> SysidFit:
    """Parameters by name, from what the rig file states. `sigma_nm` (joint,) weighs the torques."""
    tool, spec = sysid(), spec_of(rig)
    start = tool.ParameterDict()
    for key in dict.fromkeys(keys):
        start.add(_parameter(tool, spec, seen, key))
    there = np.isfinite(seen.torque_nm)

    def torque_misfit(x: Floats, params: Any) -> tuple[list[Floats], None, None]:
        columns: list[Floats] = []
        for one in x.reshape(len(x), -1).T:
            params.update_from_vector(one)
            expected = inverse_nm(tool.apply_param_modifiers(params, spec), seen)
            columns.append(((seen.torque_nm - expected) / sigma_nm)[there])
        out = np.stack(columns, axis=1)
        return [out if x.ndim > 1 else out[:, 0]], None, None

    found = start.copy()
    if len(start):
        with contextlib.redirect_stdout(io.StringIO()):  # a line an iteration, whatever it is asked
            found, _ = tool.optimize(start, torque_misfit, verbose=False, max_iters=MOST_ITERATIONS, x_scale="jac")
    return SysidFit(start, found, tool.apply_param_modifiers(found, spec))


def _parameter(tool: Any, spec: mujoco.MjSpec, seen: Motion, key: str) -> Any:
    """With bounds that any plausible arm lies within."""
    place, word = key.split(".")
    if word == "inertial":
        kind = tool.InertiaType.MassIpos
        return tool.body_inertia_param(spec, spec.compile(), place, kind, param_name=key)
    if word == "lean":
        return _lean(tool, spec, key)
    j = int(place.removeprefix("joint")) - 1
    stated = float(spec.compile().joint(place).armature[0])
    torque = float(np.nanmax(np.abs(seen.torque_nm[:, j]), initial=1e-3))
    middle, way = float(seen.q_rad[:, j].mean()), float(np.ptp(seen.q_rad[:, j]))
    most = {
        "frictionloss": torque,
        "damping": torque / float(np.abs(seen.qd_rad_s[:, j]).max()),
        "stiffness": torque / way,
        "armature": MOST_ROTOR * stated,
    }
    low, high = (middle - np.pi, middle + np.pi) if word == "springref" else (0.0, most[word])
    nominal = {"springref": middle, "armature": stated}.get(word, START * high)

    def put(of: mujoco.MjSpec, parameter: Any) -> None:
        joint = of.joint(place)
        if isinstance(getattr(joint, word), np.ndarray):  # polynomials from MuJoCo 4 on
            getattr(joint, word)[0] = parameter.value[0]
        else:
            setattr(joint, word, float(parameter.value[0]))

    return tool.Parameter(key, nominal, low, high, modifier=put)


def _lean(tool: Any, spec: mujoco.MjSpec, key: str) -> Any:
    gravity = np.array(spec.option.gravity)

    def put(of: mujoco.MjSpec, parameter: Any) -> None:
        of.option.gravity = Rotation.from_euler("xy", parameter.value).apply(gravity)

    return tool.Parameter(key, np.zeros(2), np.full(2, -MOST_LEAN_RAD), np.full(2, MOST_LEAN_RAD), modifier=put)
