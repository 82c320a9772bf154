"""A recording as the simulated rig of a model would have made it: its motion and conditions, other readings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Recording, RecordingWriter, Samples, readings_sha256
from acquisition.recording.rig import Rig
from acquisition.recording.samples import ORIENTATION, POSITION, SPOTS, WIRE, per_joint
from calibeam.simulation.physics import Physics, physics_of
from calibeam.simulation.rig_in_numbers import rigged
from calibeam.simulation.scene_of_samples import Clock, Noise, noise_of, scene_of
from calibeam.software import SOFTWARE
from calibrate.errors import DataError
from calibrate.model.model_file import ModelFile
from calibrate.model.predict import Predictor
from calibrate.model.sensors.camera import PLACE, TURN
from calibrate.model.sensors.encoder_difference import differences
from calibrate.model.sensors.full_pose import predicted_turns
from simulators.conceal.observe import shaken_rad
from simulators.conceal.rig import Device, TrueRig
from simulators.defects import Scene
from simulators.defects.detector import StrayLight
from simulators.replayed import Readings, Rigged, replayed

Floats = NDArray[np.float64]
SUMS = ("psd1_sum_v", "psd2_sum_v")
TURN_OF_LIGHT = 2.0 * np.pi


@dataclass(frozen=True, eq=False)
class Replayed:
    """The samples that the simulated rig gives, and what a person should know of them."""

    samples: Samples
    exact: Samples  # the same without noise
    physics: Physics
    noise: Noise
    same_recording: bool
    notes: tuple[str, ...]


def replay(
    recording: Recording,
    model: ModelFile,
    *,
    without: Sequence[str] = (),
    seed: int = 0,
    noisy: bool = True,
    noise_found: bool = False,
) -> Replayed:
    """`noise_found`: noise as the model found it, instead of as the rig states it.

    DataError for a model of another arm, for names that it does not list, or where nothing was measured.
    """
    samples = recording.samples
    if len(samples) == 0:
        raise DataError(f"{recording.path}: no samples, so there is no motion to replay; give a recording with samples")
    predictor = _predictor(recording.rig, model)
    same = model.readings_sha256 == readings_sha256(samples)
    physics = physics_of(model, predictor, samples.n_joints, same_recording=same, without=without)
    scene = _lit(scene_of(samples, Clock.of(model, samples.column("t_s")), same_recording=same), physics)
    rig = rigged(predictor, samples)
    exact_samples = _read(rig, scene, physics, samples, np.zeros_like(samples.joints()))
    noise = noise_of(recording.rig, model, samples, as_found=noise_found)
    shaken = exact_samples
    if noisy:
        rng = np.random.default_rng(seed)
        seated = None if rig.seat_m is None else np.asarray(np.isfinite(rig.seat_m).all(axis=1), dtype=np.bool_)
        off_rad = noise.joint_rad * rng.standard_normal(samples.joints().shape)
        if seated is not None:
            off_rad[seated] = 0.0
        shaken = _read(rig, scene, physics, samples, off_rad)
        shaken = noise.drawn(shaken, rng)
        shaken = shaken if seated is None else _in_cones(rig, seated, shaken, noise, rng)
    return Replayed(shaken, exact_samples, physics, noise, same, _notes(model, physics, same))


def write_replayed(path: Path, found: Replayed, source: Recording, notes: Mapping[str, str]) -> None:
    """As a recording of its own, with the rig of the source. RecordingError if `path` exists or cannot be made."""
    with RecordingWriter(
        path,
        rig_text=source.rig_text,
        software=SOFTWARE,
        clock=_Begun(),
        notes={**source.notes, **notes},
        host_s0=source.host_s0,
        started_utc=source.started or datetime.now(UTC),
    ) as writer:
        for row in found.samples.rows():
            writer.sample(row)


def over_noise(found: Replayed, measured: Samples) -> dict[str, tuple[float, float]]:
    """By quantity: rms of measured less simulated without noise, and rms of the noise that was drawn (0: none was)."""
    out: dict[str, tuple[float, float]] = {}
    for what, columns in QUANTITIES.items():
        here = [name for name in columns if name in measured]
        if not here:
            continue
        exact, read, noisy = (_stacked(samples, here) for samples in (found.exact, measured, found.samples))
        known = np.isfinite(exact - read).all(axis=1)
        if known.any():
            out[what] = _rms((read - exact)[known]), _rms((noisy - exact)[known])
    return out


def _stacked(samples: Samples, names: Sequence[str]) -> Floats:
    return np.stack([samples.column(name) for name in names], axis=1)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


QUANTITIES: Mapping[str, tuple[str, ...]] = {
    "spots": SPOTS,
    "positions": POSITION,
    "orientations": ORIENTATION,
    "wire lengths": (WIRE,),
    "camera positions": PLACE,
    "camera orientations": TURN,
}


def _predictor(rig: Rig, model: ModelFile) -> Predictor:
    predictor = Predictor.of(model)
    mine, its = len(rig.arm.joints), len(predictor.rig.arm.joints)
    if mine != its:
        raise DataError(f"the recording is of an arm of {mine} joints, the model of one of {its}; give its own model")
    return predictor


def _lit(scene: Scene, physics: Physics) -> Scene:
    """Sum signals as recorded hold foreign light, too: what the model knows of it is none of the laser's."""
    if scene.laser_sum_v is None:
        return scene
    laser_v = scene.laser_sum_v.copy()
    for mechanism in physics.every:
        if isinstance(mechanism.defect, StrayLight):
            laser_v[:, mechanism.defect.psd - 1] -= mechanism.defect.stray_v
    return replace(scene, laser_sum_v=laser_v)


def _read(rig: Rigged, scene: Scene, physics: Physics, samples: Samples, off_rad: Floats) -> Samples:
    """All columns of the recording, those that instruments gave as the simulated ones give them."""
    read = replayed(rig, scene, physics.mechanisms, samples.joints() + off_rad)
    columns: dict[str, NDArray[Any]] = dict(samples.columns)
    for name, values in _columns(read, rig, samples, off_rad).items():
        if name in columns:
            columns[name] = np.where(np.isfinite(samples.column(name)), values, np.nan)
    return Samples(columns, samples.n_joints)


def _columns(read: Readings, rig: Rigged, samples: Samples, off_rad: Floats) -> dict[str, Floats]:
    """By name, (row,)."""
    out: dict[str, Floats] = {}
    if rig.seat_m is not None:
        out |= dict(zip(per_joint("q", "_rad", samples.n_joints), (read.reading_rad - off_rad).T, strict=True))
    for names, values in ((SPOTS, read.spots_m), (POSITION, read.position_m), (PLACE, read.camera_m)):
        out |= {} if values is None else dict(zip(names, values.T, strict=True))
    out |= {} if read.length_m is None else {WIRE: read.length_m}
    out |= {} if read.sums_v is None else dict(zip(SUMS, read.sums_v.T, strict=True))
    if read.turn_rad is not None:
        out |= predicted_turns(_matrices(read.turn_rad), samples)
    if read.camera_rad is not None:
        out |= predicted_turns(_matrices(read.camera_rad), samples, TURN)
    return out | _second(read, samples)


def _second(read: Readings, samples: Samples) -> dict[str, Floats]:
    """Second encoders as they count: their own sense, zero and turns."""
    found = differences(samples)
    out: dict[str, Floats] = {}
    if found is None:
        return out
    for joint in found.used:
        name, column = f"enc{joint}_rad", joint - 1
        sense, zero_rad = float(found.sense[column]), float(found.zero_rad[column])
        said = sense * (samples.joints()[:, column] + zero_rad + read.between_rad[:, column])
        turns = np.round((samples.column(name) - said) / TURN_OF_LIGHT)
        out[name] = said + TURN_OF_LIGHT * np.nan_to_num(turns)
    return out


def _matrices(turn_rad: Floats) -> Floats:
    """(row, 3, 3) of rotation vectors."""
    return Rotation.from_rotvec(turn_rad).as_matrix()


def _in_cones(
    rig: Rigged, seated: NDArray[np.bool_], samples: Samples, noise: Noise, rng: np.random.Generator
) -> Samples:
    """A probe that scatters in its cone and encoders that scatter: both show in the joint angles alone."""
    joints = samples.joints()
    contact_m = noise.seat_m * rng.standard_normal((len(joints), 3))
    own = TrueRig(rig.arm, rig.tool_point_m, Device(np.eye(4)))
    off_rad = shaken_rad(own, joints, contact_m) + noise.joint_rad * rng.standard_normal(joints.shape)
    said = np.where(seated[:, np.newaxis], joints + off_rad, joints)
    names = per_joint("q", "_rad", samples.n_joints)
    return Samples({**samples.columns, **dict(zip(names, said.T, strict=True))}, samples.n_joints)


def _notes(model: ModelFile, physics: Physics, same: bool) -> tuple[str, ...]:
    out = list(physics.notes)
    if model.effects and not same:
        out.append(
            "not the recording of the model: its clock and its reference temperatures are those of its own session"
        )
    return tuple(out)


class _Begun:
    """The clock of a session that is over."""

    def now_s(self) -> float:
        return 0.0
