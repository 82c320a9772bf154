"""Moments of a recorded motion: angles, speeds, accelerations and torques of the joints, all through one low pass.

Speed and acceleration are slopes of the recorded angles behind a zero-phase low pass; the torque passes the same one,
so that what is linear in it loses nothing (parallel filtering: Gautier, Dynamic identification of robots with power
model, ICRA 1997). What changes faster than that, the sense of motion or ripple of a gear, passes it, too, from sample
to sample. Rows stand as far apart as the low pass makes them independent.

Where a joint stands or turns back, friction is anything between its two senses: its torque there is left out.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording
from acquisition.recording.examination import ExaminationRecord
from calibrate.diagnose.record.schema import TORQUES_IN_MOTION
from calibrate.diagnose.streams import StreamDevice, Track, devices_of
from calibrate.diagnose.streams.recorded import CURRENT, JOINT_TORQUE, MOTOR_TORQUE, start_between
from calibrate.diagnose.streams.track import SIGMA_OF_MEDIAN
from calibrate.model.effects.torque import Samples

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

BAND_HZ = 20.0  # below the first resonance of a geared arm there is motion, above it vibration and noise
RATE_OVER_BAND = 5.0  # slower logs are filtered at a fifth of their rate
ORDER = 4  # of the low pass, run both ways
MOST_ROWS = 600  # of six torques: more cost time and show hardly more
FEWEST_ROWS = 60
LEAST_RUN_S = 1.0  # without a gap
EDGE_PERIODS = 3.0  # of the band, that are left out at the ends of a run
TURN_PERIODS = 0.5  # and before and after a joint turns back
STAND_PERIODS = 1.25  # and before and after it stands: what friction is there nothing says, and the low pass spreads it
STILL_SHARE = 0.02  # of a joint's greatest speed; below it is taken to stand
STILL_SIGMAS = 4.0
TEMPERATURE = "joint_temperature_degC"
COUPLED = "settled poses and streams of this arm are examined; its torques are not yet"
LONGER = "record 20 s and more of motion with angles and torques in every row (docs/motion-recordings.md)"
ANGLES = "record angles and torques of all joints in one stream, or with stamps of one host"
PER_AMPERE = "state `torque_per_ampere` of the joints in the rig file"
RATIO = "state `gear_ratio` of the joints in the rig file"
MOVE = "move every joint faster, and for longer"


@dataclass(frozen=True, eq=False)
class Motion:
    """Rows are moments. NaN torque: the joint stands, turns back, or has none recorded."""

    time_s: Floats  # (moment,) on the clock of the joints
    q_rad: Floats  # (moment, joint)
    qd_rad_s: Floats  # (moment, joint)
    qdd_rad_s2: Floats  # (moment, joint)
    jerk_rad_s3: Floats  # (moment, joint)
    torque_nm: Floats  # (moment, joint)
    still_rad_s: Floats  # (joint,)
    temperature_degC: Floats | None  # (moment, joint)
    band_hz: float
    speed_sigma_rad_s: Floats  # (joint,) that the noise of the angles leaves
    acceleration_sigma_rad_s2: Floats  # (joint,)
    samples: Samples  # from which the moments were taken
    begin_s: float  # of the whole motion, also where this is a part of it

    @property
    def made(self) -> str:
        """How speed and acceleration were made, in a sentence."""
        speed, acceleration = 1e3 * self.speed_sigma_rad_s.max(), self.acceleration_sigma_rad_s2.max()
        return (
            "speeds and accelerations are slopes of the joint angles behind a zero-phase low pass of "
            f"{self.band_hz:g} Hz (noise: up to {speed:.2g} mrad/s and {acceleration:.2g} rad/s²); "
            f"{len(self.time_s)} moments"
        )


@dataclass(frozen=True, eq=False)
class Filtered:
    """Every stretch of a recording behind the low pass."""

    runs: "list[Run]"
    band_hz: float
    period_s: float


def motion_of(recording: Recording) -> Motion | ExaminationRecord:
    """The moments of a motion, or why the torques of this recording are not examined."""
    follows = [i + 1 for i, joint in enumerate(recording.rig.arm.joints) if joint.follows is not None]
    made = filtered_of(recording)
    if isinstance(made, ExaminationRecord):
        return made
    if follows:
        which = ", ".join(f"joint {i}" for i in follows)
        return _left_out(f"{which} follows another joint, and the torques of coupled drives are not modelled", COUPLED)
    if not made.runs:
        return _left_out(f"no stretch of {LEAST_RUN_S:g} s and more in which angles and torques are all there", LONGER)
    return _thinned(made.runs, recording, made.band_hz, made.period_s)


def filtered_of(recording: Recording) -> Filtered | ExaminationRecord:
    """Every stretch behind the low pass, or why there is none."""
    devices, n = devices_of(recording), recording.rig.n_joints
    joints, torque = devices.get("joints"), devices.get("torque")
    if torque is None:
        return _without_torque(recording)
    if joints is None or joints.track.channels != n or n == 0:
        return _left_out("torques were recorded without the angles of all joints", ANGLES)
    period_s = joints.track.period_s
    if not np.isfinite(period_s) or period_s <= 0.0:
        return _left_out("the time stamps of the angles do not rise", ANGLES)
    band_hz = min(BAND_HZ, 1.0 / period_s / RATE_OVER_BAND)
    torques = _on_clock_of(joints, torque)
    if torques is None:
        return _left_out("nothing shows how the clocks of angles and torques differ", ANGLES)
    valid = torques.read().values
    if not len(valid) or not np.any(np.ptp(valid, axis=0) > 0.0):
        return _left_out("the torques have no valid reading that changes", LONGER)
    there = np.full(n, -1)
    there[[torques.joint(k) - 1 for k in range(torques.channels)]] = np.arange(torques.channels)
    first = max(joints.track.time_s[0], torques.time_s[0])
    time_s = np.arange(first, min(joints.track.time_s[-1], torques.time_s[-1]), period_s)
    q_rad, torque_nm = joints.track.curve.at(time_s), torques.curve.at(time_s)[:, there]
    torque_nm[:, there < 0] = np.nan
    whole = np.all(np.isfinite(q_rad), axis=1) & np.all(np.isfinite(torque_nm[:, there >= 0]), axis=1)
    runs = [
        _filtered(time_s[run], q_rad[run], torque_nm[run], band_hz, period_s) for run in _runs(whole, band_hz, period_s)
    ]
    return Filtered(runs, band_hz, period_s)


def _left_out(reason: str, remedy: str, *, expected: bool = True) -> ExaminationRecord:
    return TORQUES_IN_MOTION.not_examined(reason, remedy=remedy, expected=expected)


def _without_torque(recording: Recording) -> ExaminationRecord:
    """What is recorded in the place of torques decides whether they could be had."""
    channels = {name for stream in recording.streams.values() for name in stream.values}
    if CURRENT in channels:
        return _left_out("motor currents were recorded, but no torque per ampere is stated", PER_AMPERE)
    if MOTOR_TORQUE in channels:
        return _left_out("motor torques were recorded, but no gear ratio is stated", RATIO)
    return _left_out(
        "no torques of the joints were recorded", TORQUES_IN_MOTION.remedy, expected=JOINT_TORQUE in channels
    )


def planned_motion(time_s: Floats, q: Floats, qd: Floats, qdd: Floats, jerk: Floats) -> Motion:
    """Of a plan, (moment, joint) each; torques are not known, and take no part."""
    still, none = STILL_SHARE * np.abs(qd).max(axis=0) + 1e-9, np.zeros(q.shape[1])
    samples = Samples.as_planned(q, qd)
    nothing, begin_s = np.full_like(q, np.nan), float(time_s[0])
    return Motion(time_s, q, qd, qdd, jerk, nothing, still, None, BAND_HZ, none, none, samples, begin_s)


def moments_in(length_s: float) -> float:
    """How many moments a motion of this length has for a diagnosis."""
    return min(MOST_ROWS, 2.0 * BAND_HZ * length_s)


def _on_clock_of(joints: StreamDevice, torque: StreamDevice) -> Track | None:
    """The torques; of another stream by the promptest arrivals. None where nothing shows how the clocks differ."""
    if torque.sequence is joints.sequence:
        return torque.track
    between, time_s = start_between(joints, torque), torque.track.time_s
    if between is None:
        return None
    shifted_s = time_s + between.offset_s + between.rate_error * (time_s - between.at_s)
    return replace(torque.track, time_s=shifted_s)


@dataclass(frozen=True, eq=False)
class Run:
    """At every sample of a stretch without gap but for its ends: (sample, joint) each."""

    time_s: Floats
    q_rad: Floats
    qd_rad_s: Floats
    qdd_rad_s2: Floats
    jerk_rad_s3: Floats
    torque_nm: Floats
    noise_rad: Floats  # (joint,) of one reading of an angle
    edge: int  # samples that are left out at each end
    whole: tuple[Floats, Floats]  # angles and speeds, those of the ends, too


def _runs(whole: Flags, band_hz: float, period_s: float) -> list[NDArray[np.intp]]:
    """Stretches that are long enough for the low pass, and for something between its ends."""
    rows = np.flatnonzero(whole)
    parts = np.split(rows, 1 + np.flatnonzero(np.diff(rows) > 1))
    least = max(LEAST_RUN_S / period_s, 2 * round(EDGE_PERIODS / band_hz / period_s) + 3, 3 * (2 * ORDER + 1) + 1)
    return [part for part in parts if len(part) >= least]


def _filtered(time_s: Floats, q_rad: Floats, torque_nm: Floats, band_hz: float, period_s: float) -> Run:
    smooth = _low_pass(q_rad, band_hz, period_s)
    speed = np.gradient(smooth, period_s, axis=0)
    noise = SIGMA_OF_MEDIAN * np.median(np.abs(q_rad - smooth), axis=0)
    acceleration, torque = np.gradient(speed, period_s, axis=0), torque_nm.copy()
    jerk = np.gradient(acceleration, period_s, axis=0)
    measured = np.isfinite(torque_nm).all(axis=0)
    torque[:, measured] = _low_pass(torque_nm[:, measured], band_hz, period_s)
    edge = round(EDGE_PERIODS / band_hz / period_s)
    inside = slice(edge, len(time_s) - edge)
    moved = smooth[inside], speed[inside], acceleration[inside], jerk[inside]
    return Run(time_s[inside], *moved, torque[inside], noise, edge, (smooth, speed))


def _low_pass(values: Floats, band_hz: float, period_s: float) -> Floats:
    from scipy.signal import sosfiltfilt  # a diagnosis of poses starts sooner without

    return np.asarray(sosfiltfilt(_sections(2.0 * band_hz * period_s), values, axis=0), dtype=np.float64)


@lru_cache(maxsize=4)
def _sections(share_of_nyquist: float) -> Floats:
    from scipy.signal import butter

    return np.asarray(butter(ORDER, share_of_nyquist, output="sos"))


def _thinned(runs: list[Run], recording: Recording, band_hz: float, period_s: float) -> Motion | ExaminationRecord:
    speed, acceleration = _gains(band_hz, period_s)
    noise = np.max([run.noise_rad for run in runs], axis=0)
    fastest = np.max([np.abs(run.qd_rad_s).max(axis=0) for run in runs], axis=0)
    still = np.maximum(STILL_SHARE * fastest, STILL_SIGMAS * speed * noise) + 1e-9
    step = max(1, round(0.5 / band_hz / period_s), -(-sum(len(run.time_s) for run in runs) // MOST_ROWS))
    parts = [_rows(run, still, 1.0 / band_hz / period_s, step) for run in runs]
    time_s, q, qd, qdd, jerk, torque = (np.concatenate(each) for each in zip(*parts, strict=True))
    if len(time_s) < FEWEST_ROWS:
        return _left_out(f"only {len(time_s)} moments of motion, of {FEWEST_ROWS} at least", LONGER)
    if not np.isfinite(torque).any():
        return _left_out("no joint moves for long enough to show its torque", MOVE)
    heat = _temperatures(recording, time_s, q.shape[1])
    samples = _samples(runs, step, lambda values: _low_pass(values, band_hz, period_s))
    sigmas = speed * noise, acceleration * noise
    return Motion(time_s, q, qd, qdd, jerk, torque, still, heat, band_hz, *sigmas, samples, float(time_s[0]))


def _samples(runs: list[Run], step: int, low_pass: Callable[[Floats], Floats]) -> Samples:
    lengths = [len(run.whole[0]) for run in runs]
    first = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    rows = [np.arange(at + run.edge, at + n - run.edge, step) for at, n, run in zip(first, lengths, runs, strict=True)]
    q, qd = (np.concatenate(each) for each in zip(*(run.whole for run in runs), strict=True))
    return Samples(q, qd, np.concatenate(rows), tuple(first[1:].tolist()), low_pass)


def _rows(run: Run, still: Floats, period: float, step: int) -> tuple[Floats, ...]:
    """Every `step`-th sample; NaN: the joint stands or turns back about it. `period`: samples in one of the band."""
    sense = np.where(np.abs(run.qd_rad_s) < still, 0.0, np.sign(run.qd_rad_s))
    near, far = round(TURN_PERIODS * period), round(STAND_PERIODS * period)
    stands = _stands(sense == 0.0, far)
    steady = ~_about(stands, far) & ~_about(sense == 0.0, near)
    torque = np.where(steady, run.torque_nm, np.nan)
    moved = run.q_rad, run.qd_rad_s, run.qdd_rad_s2, run.jerk_rad_s3
    return tuple(part[::step] for part in (run.time_s, *moved, torque))


def _stands(slow: Flags, least: int) -> Flags:
    """(sample, joint) where it is slow for more than `least` samples in a row: not only while it turns back."""
    return _about(~_about(~slow, least // 2), least // 2)


def _about(here: Flags, samples: int) -> Flags:
    """(sample, joint) within so many samples of one that is true."""
    from scipy.ndimage import binary_dilation  # as the low pass

    return binary_dilation(here, np.ones((2 * samples + 1, 1), dtype=bool)).astype(np.bool_)


def _gains(band_hz: float, period_s: float) -> tuple[float, float]:
    """Sigma of speed (1/s) and acceleration (1/s²) for independent noise of 1 on every angle."""
    impulse = np.zeros(2 * round(10.0 / band_hz / period_s) + 1)
    impulse[len(impulse) // 2] = 1.0
    speed = np.gradient(_low_pass(impulse, band_hz, period_s), period_s)
    return float(np.linalg.norm(speed)), float(np.linalg.norm(np.gradient(speed, period_s)))


def _temperatures(recording: Recording, time_s: Floats, n: int) -> Floats | None:
    """(moment, joint) on the clock of the joints' device; None where it did not read any."""
    for stream in recording.streams.values():
        if TEMPERATURE in stream.values and len(stream.device_s) > 1:
            values = np.asarray(stream.values[TEMPERATURE], dtype=float).reshape(len(stream.device_s), -1)
            if values.shape[1] == n and np.isfinite(values).all():
                return np.stack([np.interp(time_s, stream.device_s, column) for column in values.T], axis=1)
    return None
