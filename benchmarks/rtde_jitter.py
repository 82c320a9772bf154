"""RTDE at 500 Hz into a recording: whether a cycle is missed, and how late packages arrive.

A cycle counts as missed when the controller's time stamps in the finished file leave it out. Lateness is a package's
host time less its time stamp, less the least of that within the same second: what the line, this machine and the
reader's gathering add; an emulator that falls behind the wall clock for good is no lateness.
"""

import json
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from acquisition.recording import Channel, RecordingWriter, read
from acquisition.recording.rig import plain_rig, rig_text
from acquisition.wires.streams import Pump
from drivers.clock import SystemClock
from drivers.ur.reader import UrReader
from simulators.process import Emulators

RATE_HZ = 500.0
EDGES_MS = (0.0, 1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0, 200.0, 500.0, np.inf)


def lines(rig: Path, seconds: float, out: Path) -> Iterator[str]:
    """Records for so long; leaves the recording and jitter.json in `out`."""
    out.mkdir(parents=True, exist_ok=True)
    recording = out / "rtde.mcap"
    recording.unlink(missing_ok=True)
    failures, pace = _record(rig, seconds, recording)
    stream = read(recording).streams["robot"]
    missed = int((np.diff(stream.sequence) - 1).sum())
    late_s = stream.host_s - stream.device_s
    seconds_of = np.searchsorted(stream.device_s, np.arange(stream.device_s[0], stream.device_s[-1]))
    least_s = np.repeat(np.minimum.reduceat(late_s, seconds_of), np.diff([*seconds_of, len(late_s)]))
    late_ms = 1e3 * (late_s - least_s)
    counts, _ = np.histogram(late_ms, EDGES_MS)
    percentiles = {f"p{q}": round(float(np.percentile(late_ms, q)), 3) for q in (50, 99, 99.9, 100)}
    result = {
        "seconds": seconds, "cycles": len(stream.sequence), "missed": missed, "failures": failures,
        "late_ms": percentiles, "edges_ms": [edge for edge in EDGES_MS if edge < np.inf], "counts": counts.tolist(),
        "emulator": pace,
    }  # fmt: skip
    (out / "jitter.json").write_text(json.dumps(result, indent=1) + "\n")
    yield f"{len(stream.sequence)} cycles in {seconds:.0f} s, {missed} missed by the recorder, failures: {failures}"
    yield f"lateness in ms: {percentiles}; emulator: {pace['stalls']} stalls of {pace['lost_s']:.2f} s altogether"
    for edge, after, count in zip(EDGES_MS, EDGES_MS[1:], counts, strict=False):
        yield f"  {edge:6.0f} to {after:6.0f} ms  {count}"


def _record(rig: Path, seconds: float, recording: Path) -> tuple[list[str], dict[str, float]]:
    text, clock = rig_text(rig), SystemClock()
    plain = plain_rig(text, str(rig))
    plain["devices"] = {"robot": plain["devices"]["robot"]}
    failures: list[str] = []
    with Emulators(plain) as emulators:
        reader = UrReader(emulators.address["robot"]["host"], RATE_HZ)
        reader.connect()
        channels = tuple(Channel(c.name, c.unit, c.shape, c.full_scale, c.resolution) for c in reader.describe())
        with RecordingWriter(recording, rig_text=text, software="benchmark", clock=clock) as writer:
            stream = writer.stream("robot", channels, ("actual_q_rad",))
            pump = Pump(
                reader,
                clock,
                lambda block: stream.append(block.host_s, block.device_s, block.sequence, block.values),
                lambda failure: failures.append(str(failure)),
            )
            pump.start()
            time.sleep(seconds)
            pump.stop()
        return failures, emulators.ask("host.pace")
