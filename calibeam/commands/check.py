"""`calibeam check`: every device of a rig, or what is in a recording or a folder of log segments, and what is wrong."""

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from cyclopts import Parameter

from acquisition.recording import Finding, Recording, Stream, check, read
from acquisition.recording.check_recording import NO_ANSWER, NO_READING
from acquisition.recording.device_clock import ClockModel, ClockStatus, clock_model
from acquisition.recording.examination import ExaminationRecord
from acquisition.recording.mcap import segments
from acquisition.recording.rig import load_rig, parse_rig
from acquisition.recording.samples import Floats
from calibeam.console import Console
from calibeam.devices.check import check_devices
from calibeam.outcome import CheckFailed
from calibeam.overwriting import writes
from calibeam.results.check_examinations import check_examinations, verdict_lines
from calibeam.results.controller_findings import (
    RIG_FILE,
    arm_of_controller,
    arm_of_poses,
    controller_findings,
    write_controller_arm,
)
from calibrate.diagnose.streams import devices_of, examine_encoders
from calibrate.errors import DataError
from calibrate.fit.controller_arm import ControllerPoses
from calibrate.quantities import angle, angle_with_sigma
from drivers.clock import SystemClock

SAME_S = 1.0  # longer than any driver keeps a sample
EMULATED = 0.01  # of the rate: no clock of a device runs so far off; emulators run at another pace than real time
CLEAR = 5.0  # sigmas of an eccentricity that is reported
MOST_LINES = 20  # findings of one file printed one by one; a script gets all of them with --json


def check_recording(path: Path, *, as_json: bool = False, controller_arm: Path | None = None) -> bool:
    """Print what is in it and what was found; True when there is no error. RecordingError when it cannot be read.

    `controller_arm`: where the controller's arm is written, of all segments of a log one. DataError where they do not
    show it, or are of several rigs.
    """
    files = segments(path) if path.is_dir() else []
    good, rig_texts, poses = True, dict[str, Path](), list[ControllerPoses]()
    for file in files or [path]:
        recording = read(file)
        arm = arm_of_controller(recording)
        if controller_arm is not None:
            poses += filter(None, [ControllerPoses.of(recording)])
            first = rig_texts.setdefault(recording.rig_text, file)
            if len(rig_texts) > 1:
                other = next(iter(rig_texts.values()))
                raise DataError(
                    f"--controller-arm: {other} and {first} are recordings of different rig files; give each by itself"
                )
        findings = (*check(recording), *controller_findings(arm))
        examinations = check_examinations(recording, findings, arm)
        good = good and not any(finding.is_error for finding in findings)
        if as_json:
            print(msgspec.json.encode(_as_json(recording, findings, examinations)).decode())
        else:
            Console(highlight=False, soft_wrap=True).print(
                "\n".join(lines(recording, findings, examinations)), markup=False
            )
    if controller_arm is not None:
        rig = parse_rig(next(iter(rig_texts)), str(path))
        write_controller_arm(rig, arm_of_poses(rig, ControllerPoses.joined(poses)), path, controller_arm)
    return good


def lines(
    recording: Recording, findings: tuple[Finding, ...], examinations: tuple[ExaminationRecord, ...]
) -> list[str]:
    """For a person: the file, each stream with its rate and clock, each finding."""
    settled = f"settled samples: {len(recording.samples)}, " if recording.rig.n_joints else ""
    reported = [f"{recording.path}: {settled}events: {len(recording.events)}"]
    reported += [
        f"  {stream.name}: {_rate(stream)}; {_clock(stream)}; time stamp: {stream.stamps}"
        for stream in recording.streams.values()
    ]
    reported += [f"  encoders: {line}" for line in encoder_lines(recording)]
    reported += [f"  {f.severity.value}: {f.problem.value}: {f.where}: {f.says}" for f in findings[:MOST_LINES]]
    if len(findings) > MOST_LINES:
        reported.append(f"  and {len(findings) - MOST_LINES} more findings; --json prints all")
    return [*reported, *(f"  {line}" for line in verdict_lines(findings, examinations))]


def encoder_lines(recording: Recording) -> Iterator[str]:
    """Of a log of encoders alone: pace, and each encoder against the first."""
    device = devices_of(recording).get("encoders") if recording.rig.n_joints == 0 else None
    if device is None:
        return
    pace, pairs = examine_encoders(device)
    if pace is not None:
        yield (
            f"period {_ms(pace.period_s)}, jitter {1e6 * pace.jitter_s:.0f} µs (1 sigma), "
            f"longest time between two rows {_ms(pace.longest_s)}"
        )
    yield from _unanswered(recording, device.track.values)
    for pair in pairs:
        against = f"encoder {pair.number} against encoder 1"
        noise = "" if pair.noise_rad is None else f"noise of a reading {angle(pair.noise_rad, 2)}; "
        once = pair.once_rad
        if once is not None and once.value > CLEAR * once.sigma:
            yield f"{against}: {noise}eccentricity {angle_with_sigma(once.value, once.sigma)}, once a turn"
        elif once is not None:
            yield f"{against}: {noise}no eccentricity found, detection limit {angle(CLEAR * once.sigma, 2)}"
        if pair.why:
            yield f"{against}: {noise}not determined: {pair.why}"
        for slip in pair.slips:
            at_s = slip.from_s - recording.host_s0, slip.to_s - recording.host_s0
            size = angle_with_sigma(slip.size_rad, slip.sigma_rad)
            yield f"{against}: slip of {size} between {at_s[0]:.2f} and {at_s[1]:.2f} s"


def _unanswered(recording: Recording, angles_rad: Floats) -> Iterator[str]:
    """Rows without an angle; where the recording holds no reasons, both are named. Those left out are findings."""
    codes = next((s.values[NO_READING] for s in recording.streams.values() if NO_READING in s.values), None)
    missing = np.isnan(angles_rad) if codes is None else codes == NO_ANSWER
    why = "no answer" if codes is not None else "no angle (no answer, or a step faster than a joint turns)"
    yield from (f"encoder {k + 1}: {why} in {n} rows" for k, n in enumerate(missing.sum(axis=0)) if n)


def _rate(stream: Stream) -> str:
    count = stream.host_s.size
    span_s = float(stream.host_s[-1] - stream.host_s[0]) if count > 1 else 0.0
    rate = f", {(count - 1) / span_s:.1f} a second over {span_s:.1f} s" if span_s > 0.0 else ""
    return f"samples: {count}{rate}"


def _clock(stream: Stream) -> str:
    if (late_s := _after_host_stamps(stream)) is not None:
        median_s, p99_s = np.quantile(late_s, [0.5, 0.99])
        return f"stamped by the host's clock, arrive {_ms(median_s)} later in the median, {_ms(p99_s)} at 99 %"
    model = clock_model(stream)
    if model.status is not ClockStatus.FOUND:
        return f"clock: {model.status.value}"
    delays = f"arrive {_ms(model.delay_median_s)} late in the median, {_ms(model.delay_p99_s)} at 99 %"
    wander = "" if model.wander_s is None else f", clock wanders {_ms(model.wander_s)}"
    rate = model.rate or 1.0
    if abs(rate - 1.0) > EMULATED:
        return f"recorded at {1.0 / rate:.3g} x real time by emulators, so that delays have no meaning"
    return f"clock {1e6 * (rate - 1.0):+z.1f} µs/s against the host, {delays}{wander}"


def _after_host_stamps(stream: Stream) -> Floats | None:
    """How long after its stamp each sample came, where the driver stamps for a device that has no clock.

    No clock of a device shows the host's time since it was started to SAME_S.
    """
    late_s = stream.host_s - stream.device_s
    stamped = late_s.size > 0 and bool(np.isfinite(late_s).all())
    return late_s if stamped and late_s.min() >= 0.0 and late_s.max() < SAME_S else None


def _ms(seconds: float | None) -> str:
    return "-" if seconds is None else f"{1e3 * seconds:.2f} ms"


def _as_json(
    recording: Recording, findings: tuple[Finding, ...], examinations: tuple[ExaminationRecord, ...]
) -> dict[str, Any]:
    return {
        "recording": str(recording.path),
        "complete": recording.complete,
        "samples": len(recording.samples),
        "streams": {
            stream.name: {
                "samples": stream.host_s.size,
                "stamps": stream.stamps,
                "gaps": len(stream.gaps),
                "clock": _model(clock_model(stream)),
            }
            for stream in recording.streams.values()
        },
        "encoders": list(encoder_lines(recording)),
        "examinations": msgspec.to_builtins(examinations),
        "findings": [
            {"severity": f.severity.value, "problem": f.problem.value, "where": f.where, "says": f.says}
            for f in findings
        ],
    }


def _model(model: ClockModel) -> dict[str, Any]:
    return msgspec.to_builtins(model) | {"status": model.status.name.lower()}


@writes(controller_arm=RIG_FILE)
def check_command(
    what: Path,
    *,
    controller_arm: Path | None = None,
    json_: Annotated[bool, Parameter(name="--json")] = False,
) -> None:
    """Check every device of a rig, or check a recording; no motion.

    One line a device; the arm does not move. A recording is checked for missing samples, clocks and gross errors.

    For example:

    ```
    calibeam check rigs/ur5e-dual-psd.toml
    calibeam check session-1/recording.mcap
    calibeam check session-1/recording.mcap --controller-arm controller.toml
    ```

    Each line starts with ok or error; then what the device is, its firmware, rate and noise, what is wrong and the
    remedy. Findings of a recording are errors, warnings or information. Exit code 1 when there is an error.

    Parameters
    ----------
    what
        A rig file (.toml), a recording (.mcap), or a folder of log segments.
    controller_arm
        Write the arm that the robot's controller computes with as a rig file, from its tool poses in the recording.
    json_
        Print one line of JSON for each device or file.

    """
    if what.suffix != ".toml":
        if not check_recording(what, as_json=json_, controller_arm=controller_arm):
            raise CheckFailed(f"{what}: it has errors, see above")
        return
    if controller_arm is not None:
        raise DataError(f"--controller-arm: {what} is a rig file; give a recording with the controller's tool poses")
    rig = load_rig(what, needs_arm=False)
    bad: list[str] = []
    for found in check_devices(rig, SystemClock()):
        print(json.dumps(asdict(found)) if json_ else found.line, flush=True)
        bad += [found.device] if found.wrong else []
    if bad:
        raise CheckFailed(f"{', '.join(bad)}: not fit for a session, see above")
