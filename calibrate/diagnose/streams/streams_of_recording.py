"""The streams of a recording beside its diagnosis: what is wrong with them, by the model that was fitted.

Where a fitted model has the spots at any moment of the motion: where the beam falls on both faces.

When the samples of a recording were taken, on the clocks of its devices.

What the streams show, in the record that diagnosis.json holds.

Missing samples and the way in which every servo follows its set-point are reported with their size, but are no reason
to question the model: they stand beside the findings, and do not decide the verdict.
"""

import math
from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from acquisition.recording import Recording
from acquisition.recording.rig import Rig
from calibrate.diagnose.assess.diagnosis import NAMED, Named, Verdict
from calibrate.diagnose.record.pose_examinations import REPORT
from calibrate.diagnose.record.schema import (
    ClockRecord,
    DiagnosisFile,
    FindingRecord,
    RivalRecord,
    SizeRecord,
    StreamsRecord,
)
from calibrate.diagnose.state.fitted import Fitted
from calibrate.diagnose.streams.angle_offsets import GravityLevers
from calibrate.diagnose.streams.clock import ClockFit
from calibrate.diagnose.streams.examine import Predicted, StreamReport, examine
from calibrate.diagnose.streams.recorded import StreamDevice, by_host, devices_of
from calibrate.diagnose.streams.settling import Window
from calibrate.diagnose.streams.slips import causes_of
from calibrate.diagnose.streams.stream_examinations import stream_examinations_left_out
from calibrate.diagnose.streams.stream_findings import StreamFinding
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.parameters import start_values
from calibrate.model.predict import Predictor

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

EVENT = "sample"  # one a sample, in their order, with `psd_from_s` and `psd_to_s`


@dataclass(frozen=True, eq=False)
class AroundSamples:
    """Where the fixture stood and which face came first, by the samples before and after a time."""

    time_s: Floats  # (sample,) rising
    placement: Ints
    first_psd: Ints

    def at(self, time_s: Floats) -> tuple[Ints, Ints]:
        """(row,) placement and first face; 0 where the sample before and the one after differ."""
        after = np.searchsorted(self.time_s, time_s)
        before, after = np.clip(after - 1, 0, None), np.clip(after, None, len(self.time_s) - 1)
        same = (self.placement[before] == self.placement[after]) & (self.first_psd[before] == self.first_psd[after])
        return np.where(same, self.placement[before], 0), np.where(same, self.first_psd[before], 0)


def sample_windows(recording: Recording) -> tuple[Window, ...] | None:
    """On the clock of the PSD box, one a sample; None where the recording does not state it."""
    details = [event.detail for event in recording.events if event.kind == EVENT]
    if not details or len(details) != len(recording.samples):
        return None
    try:
        return tuple(Window(float(one["psd_from_s"]), float(one["psd_to_s"])) for one in details)
    except (KeyError, TypeError, ValueError):
        return None


def around(
    recording: Recording, windows: tuple[Window, ...] | None, spots: StreamDevice, joints: StreamDevice
) -> AroundSamples | None:
    """On the clock of the joints; None where no sample states where the fixture stood.

    Without windows `t_s` counts from `host_s0`, as docs/formats.md has it.
    """
    samples = recording.samples
    if len(samples) == 0 or "placement" not in samples or "first_psd" not in samples:
        return None
    if windows is None:
        host_s = recording.host_s0 + samples.column("t_s")
        time_s = np.interp(host_s, np.maximum.accumulate(joints.host_s), joints.track.time_s)
    else:
        time_s = by_host(np.array([0.5 * (w.from_s + w.to_s) for w in windows]), spots, joints)
    order = np.argsort(time_s, kind="stable")
    placement, first = samples.integers("placement", 0), samples.integers("first_psd", 0)
    return AroundSamples(time_s[order], placement[order], first[order])


ORDERS = (1, 2)
ROWS_AT_ONCE = 20_000  # poses whose frames are held at a time


def streams_of(recording: Recording, fitted: Fitted | None) -> StreamReport | None:
    """None where no stream was recorded. Without a fit the clock of the spots stays open."""
    devices = devices_of(recording)
    if not devices:
        return None
    windows, predicted = sample_windows(recording), None
    if fitted is not None and "spots" in devices and "joints" in devices:
        placed = around(recording, windows, devices["spots"], devices["joints"])
        predicted = None if placed is None else predicted_spots(fitted, placed)
    rig = recording.rig
    zeros_rad = [joint.encoder_zero_rad for joint in rig.arm.joints] if rig.n_joints else []
    causes = None if fitted is None else causes_of(fitted)
    arm = rig.n_joints > 0
    return examine(devices, predicted, windows, causes, gravity_levers(rig), zeros_rad, arm=arm, stated=_stated(rig))


def _stated(rig: Rig) -> frozenset[str]:
    """Devices of a session that the rig file states."""
    named = {"spots": rig.devices.psd, "encoders": rig.devices.encoders, "command": rig.devices.robot}
    return frozenset(name for name, device in named.items() if device is not None)


def gravity_levers(rig: Rig) -> GravityLevers | None:
    """Torque of gravity (Nm) about each joint, of one kilogram at the end of every link behind it. None: no arm."""
    if not rig.n_joints:
        return None
    arm, gravity = arm_of(rig), np.array(rig.arm.gravity_m_s2)
    nominal = start_values(arm.parameters)

    def levers(q_rad: Floats) -> Floats:
        out = np.empty(q_rad.shape)
        for rows in np.array_split(np.arange(len(q_rad)), max(1, len(q_rad) // ROWS_AT_ONCE)):
            frames = arm.frames(nominal, q_rad[rows])
            axes, ends = frames[:, :-1, :3, 2], frames[:, 1:, :3, 3]
            for j in range(q_rad.shape[1]):
                arms = np.sum(ends[:, j:] - frames[:, j, None, :3, 3], axis=1)
                out[rows, j] = np.einsum("nk,nk->n", axes[:, j], np.cross(arms, gravity))
        return out

    return levers


def predicted_spots(fitted: Fitted, around: AroundSamples) -> Predicted | None:
    """NaN where the beam misses a face, or it is unknown where the fixture stood. None without a dual PSD."""
    rig = fitted.session.rig
    if rig.fixture is None or not rig.placements:
        return None
    half_m = rig.fixture.half_size_m
    values = {p.name: float(v) for p, v in zip(fitted.session.parameters, fitted.geometry, strict=True)}
    model = Predictor(rig, values, {}, ())

    def spots(q_rad: Floats, time_s: Floats) -> Floats:
        placement, first = around.at(time_s)
        out = np.full((len(q_rad), 4), np.nan)
        known = np.isin(placement, list(rig.placements)) & np.isin(first, ORDERS)
        if not np.any(known):
            return out
        with np.errstate(all="ignore"):  # a beam beside the faces may meet their planes anywhere, or nowhere
            out[known] = model.spots_m(q_rad[known], placement[known], first[known])
            out[~np.all(np.abs(out) < half_m, axis=1)] = np.nan
        return out

    return spots


SLIP = "encoder-slip"
USUAL = ("following-error", "missing-samples", "duplicated-samples")
EXPLAINS = {
    "latency": "A stamp that is set late, or a clock of its own, puts a reading beside angles of another moment.",
    "reading-lag": "A filter or a slow bus delivers one joint's reading later than those of the others.",
    "following-error": "A position loop without full feed-forward is behind its set-point in proportion to the speed.",
    "encoder-slip": "A disc, coupling or belt slipped: its reading is off by a constant from then on.",
    "not-settled": "A servo and what it carries approach the target for a while; a sample taken then misses the rest.",
    "ringing": "A part on a spring, set swinging by the stop, swings on and fades.",
    "frozen-reading": "A device that repeats an old value seems to work, but measures nothing new.",
    "clock-step": "A clock that is set while it runs divides the stream in two times.",
    "time-backwards": "Samples came out of order, or the clock was set back.",
    "missing-samples": "What a bus or its reader lost; gaps are left as gaps.",
    "duplicated-samples": "The same sample was delivered again.",
    "angle-offset": "A zero that was set or stored otherwise, or a reading that belongs to another joint's zero.",
    "droop": "A position loop without integral action, or a soft drive, hangs in proportion to the torque of gravity.",
}


def with_streams(file: DiagnosisFile, report: StreamReport | None, *, failed: str = "") -> DiagnosisFile:
    """The diagnosis with what its recording's streams show; findings of the samples stay in front. `failed`: why there
    is no report although there are streams.
    """
    if failed:
        left_out = stream_examinations_left_out(f"the stage failed: {failed}", REPORT)
        return replace(file, examinations=(*file.examinations, *left_out))
    if report is None:
        return file
    new_findings = [_finding(one) for one in report.findings if not _known(one, file)]
    faults = tuple(one for one in new_findings if one.physics not in USUAL)
    streams = StreamsRecord(
        len(report.stands),
        tuple(_clock(name, fit) for name, fit in report.clocks.items()),
        tuple(one for one in new_findings if one.physics in USUAL),
        report.unseen,
    )
    differs = faults and file.verdict == Verdict.CONSISTENT.value
    verdict = Verdict.MISMATCH.value if differs else file.verdict
    examinations = (*file.examinations, *report.examinations)
    return replace(file, verdict=verdict, findings=file.findings + faults, streams=streams, examinations=examinations)


def _known(one: StreamFinding, file: DiagnosisFile) -> bool:
    """A slip that the samples show already: they give its size, the streams would report it a second time."""
    slip = one.name.physics == SLIP
    return slip and any(f.physics == SLIP and f.where == one.name.where for f in file.findings)


def _finding(one: StreamFinding) -> FindingRecord:
    sure = NAMED * (1.0 - one.p)
    return FindingRecord(
        *_words(one.name),
        parameters={n: SizeRecord(_number(size.value), _number(size.sigma)) for n, size in one.parameters.items()},
        share=None,
        confidence=sure / (1 + len(one.rivals)),
        says=one.says,
        rivals=tuple(
            RivalRecord(*_words(rival), confidence=sure / (1 + len(one.rivals)), margin=0.0) for rival in one.rivals
        ),
        p=one.p,
        bic_gain=None,
        held_out_gain=None,
        explains=EXPLAINS.get(one.name.physics, ""),
        stream=one.stream,
        from_s=one.from_s,
        to_s=one.to_s,
    )


def _clock(name: str, fit: ClockFit) -> ClockRecord:
    return ClockRecord(
        name, fit.status.value, fit.offset_s, fit.offset_sigma_s, fit.drift, fit.drift_sigma, fit.middle_s
    )


def _words(name: Named) -> tuple[str, str, str, int | None, str]:
    return name.where, ",".join(name.depends_on), name.shape, name.order, name.physics


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
