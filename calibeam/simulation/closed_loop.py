"""A recorded motion replayed by a simulated arm in closed loop: its set-points, a servo as the controller's, MuJoCo.

The servo is learned from the recording, joint by joint, by least squares:

    torque = c1 e + c2 (M e) + c3 e' + c4 (M e') + c5 I(e) + c6 h + c7 (M s'') + c8 s' + c9 (M s') + c10,    e = s - q

with set-points s, M and h (inertia and bias torque) of the simulation that is to be improved, I(e) the integral of e:
position servos with or without computed torque or feed-forward are of this form (Siciliano et al., Robotics: Modelling,
Planning and Control, 2009, sections 8.3 to 8.5); s' stands for a set-point that is logged earlier or later than q. The
same servo then moves every arm that is compared, from the same state; how far its joints are from the recorded ones is
the tracking.
"""

import importlib
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from acquisition.recording import Recording
from calibrate.apply.export import export_model, form_named
from calibrate.diagnose.motion import model_of_motion
from calibrate.diagnose.streams import devices_of
from calibrate.model.torque_records import TorquesOfModel

Floats = NDArray[np.float64]

EXPLAINED = 0.8  # of the variance of a joint's torque: less, and the servo is not of this form
STEP_S = 5e-4
LEARNED_HZ = 20.0  # set-points of 100 Hz and more are a motion below it, and steps above
LEAST_S = 2.0  # to learn from, and to replay
BEYOND_RAD = 0.5  # off the recording, nothing is replayed any more


@dataclass(frozen=True, eq=False)
class Followed:
    """What a recording holds of a servo, (sample, joint) each, evenly spaced."""

    time_s: Floats
    q_rad: Floats
    set_rad: Floats
    torque_nm: Floats


@dataclass(frozen=True, eq=False)
class Servo:
    """Gains (term, joint) by the form above, and the terms that do not depend on the replay."""

    gains: Floats
    inertia: Floats  # (sample, joint, joint) kg m²
    known_nm: Floats  # (sample, joint)


def tracked(recording: Recording, arms: Sequence[TorquesOfModel], cut_s: float) -> tuple[list[Floats] | None, str]:
    """Of each arm (joint,) rad rms off the recorded angles from `cut_s` on; the first is the one whose M and h the
    servo has. None, and why, where there is no replay.
    """
    followed = _followed(recording)
    if followed is None:
        return None, "no replay: set-points and torques of all joints in one stretch are needed"
    cut = min(int(np.searchsorted(followed.time_s, cut_s)), len(followed.time_s) - 1)
    if followed.time_s[cut] - followed.time_s[0] < LEAST_S or followed.time_s[-1] - followed.time_s[cut] < LEAST_S:
        return None, f"no replay: less than {LEAST_S:g} s to learn the servo from, or to replay"
    models = [_in_mujoco(recording, arm) for arm in arms]
    servo, explained = _learned(followed, models[0], cut)
    if explained.min() < EXPLAINED:
        j = int(np.argmin(explained))
        return None, (
            f"no replay: set-points, following errors and speeds explain {100.0 * explained[j]:.0f} % of the torque of "
            f"joint {j + 1} only; its servo is of another form"
        )
    off = [_replayed(followed, servo, model, cut) for model in models]
    if not np.all(np.isfinite(off)):
        return None, "no replay: under the servo learned from the recording a simulated arm does not stay on its motion"
    return off, ""


def _followed(recording: Recording) -> Followed | None:
    devices = devices_of(recording)
    joints, command, torque = (devices.get(name) for name in ("joints", "command", "torque"))
    n = recording.rig.n_joints
    if joints is None or command is None or torque is None:
        return None
    same = all(one.sequence is joints.sequence for one in (command, torque))
    if not same or any(one.track.channels != n for one in (joints, command, torque)):
        return None
    period_s = joints.track.period_s
    time_s = np.arange(joints.track.time_s[0], joints.track.time_s[-1], period_s)
    values = [one.track.curve.at(time_s) for one in (joints, command, torque)]
    whole = np.all([np.isfinite(one).all(axis=1) for one in values], axis=0)
    rows = np.flatnonzero(whole)
    longest = max(np.split(rows, 1 + np.flatnonzero(np.diff(rows) > 1)), key=len) if len(rows) else rows
    return Followed(time_s[longest], *(one[longest] for one in values)) if len(longest) > 2 else None


def _in_mujoco(recording: Recording, torques: TorquesOfModel) -> Any:
    """The very file that `calibeam export-model --to mjcf` writes."""
    mujoco: Any = importlib.import_module("mujoco")  # its stubs lack most names
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.xml"
        export_model(path, recording.rig, model_of_motion(recording, torques), form_named("mjcf"))
        model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.timestep = STEP_S
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.jnt_limited[:] = 0
    return model


def _learned(followed: Followed, model: Any, cut: int) -> tuple[Servo, Floats]:
    """And (joint,) share of the torque's variance that it explains."""
    mujoco: Any = importlib.import_module("mujoco")
    period_s = float(np.median(np.diff(followed.time_s)))
    data, n = mujoco.MjData(model), followed.q_rad.shape[1]
    inertia, bias = np.zeros((len(followed.time_s), n, n)), np.zeros_like(followed.q_rad)
    set_speed = np.gradient(followed.set_rad, period_s, axis=0)
    for k, (q, qd) in enumerate(zip(followed.set_rad, set_speed, strict=True)):
        data.qpos[:], data.qvel[:] = q, qd
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, inertia[k])
        bias[k] = data.qfrc_bias
    rates = set_speed, np.gradient(set_speed, period_s, axis=0)
    speed, forward = (np.einsum("kij,kj->ki", inertia, rate) for rate in rates)
    error = followed.set_rad - followed.q_rad
    terms = _terms(error, np.gradient(error, period_s, axis=0), np.cumsum(error, axis=0) * period_s, inertia)
    columns = np.stack([*terms, bias, forward, set_speed, speed, np.ones_like(bias)], axis=2)  # (sample, joint, term)
    gains, explained = np.zeros((columns.shape[2], n)), np.zeros(n)
    slow, felt = (_slow(one, period_s) for one in (columns[:cut], followed.torque_nm[:cut]))
    for j in range(n):
        seen, torque = slow[:, j], felt[:, j]
        size = np.maximum(np.linalg.norm(seen, axis=0), 1e-12)
        gains[:, j] = np.linalg.lstsq(seen / size, torque, rcond=1e-6)[0] / size
        explained[j] = 1.0 - float(np.var(torque - seen @ gains[:, j]) / max(np.var(torque), 1e-12))
    known = np.einsum("kjt,tj->kj", columns[:, :, len(terms) :], gains[len(terms) :])
    return Servo(gains, inertia, known), explained


def _slow(values: Floats, period_s: float) -> Floats:
    """(sample, ...) behind one zero-phase low pass: what is linear stays, chatter from set-point to set-point goes."""
    sections = butter(4, min(2.0 * LEARNED_HZ * period_s, 0.5), output="sos")
    return np.asarray(sosfiltfilt(sections, values, axis=0), dtype=np.float64)


def _terms(error: Floats, rate: Floats, integral: Floats, inertia: Floats) -> tuple[Floats, ...]:
    """Those that depend on the replay, each (..., joint)."""
    weighed, weighed_rate = (np.einsum("...ij,...j->...i", inertia, one) for one in (error, rate))
    return error, weighed, rate, weighed_rate, integral


def _replayed(followed: Followed, servo: Servo, model: Any, cut: int) -> Floats:
    """(joint,) rad rms; inf where the arm runs away."""
    mujoco: Any = importlib.import_module("mujoco")
    data, period_s = mujoco.MjData(model), float(np.median(np.diff(followed.time_s)))
    speed, set_speed = (np.gradient(one, period_s, axis=0) for one in (followed.q_rad, followed.set_rad))
    data.qpos[:], data.qvel[:] = followed.q_rad[cut], speed[cut]
    integral = period_s * np.sum((followed.set_rad - followed.q_rad)[:cut], axis=0)
    steps, off = max(1, round(period_s / STEP_S)), np.zeros_like(followed.q_rad[cut:])
    model.opt.timestep = period_s / steps
    told = np.stack([followed.set_rad, set_speed, servo.known_nm], axis=1)  # (sample, 3, joint)
    for k in range(cut, len(followed.time_s) - 1):
        for step in range(steps):
            set_rad, set_rad_s, known_nm = told[k] + step / steps * (told[k + 1] - told[k])
            error, rate = set_rad - data.qpos, set_rad_s - data.qvel
            terms = np.stack(_terms(error, rate, integral, servo.inertia[k]))
            data.qfrc_applied[:] = known_nm + np.sum(terms * servo.gains[: len(terms)], axis=0)
            mujoco.mj_step(model, data)
            integral = integral + error * model.opt.timestep
        off[k + 1 - cut] = data.qpos - followed.q_rad[k + 1]
        if np.abs(off[k + 1 - cut]).max() > BEYOND_RAD:
            return np.full(len(data.qpos), np.inf)
    return np.asarray(np.sqrt(np.mean(off**2, axis=0)))
