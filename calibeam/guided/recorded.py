"""A guided session that is recorded: connects the encoders, runs the plan, and whatever happens the file is whole.

The assumed arm gives where the probe is and which postures bring it somewhere.
"""

from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.guided.plan import GuidedVisit
from acquisition.guided.reading import Guide, Reading
from acquisition.guided.session import GuidedSession, GuidedSummary
from acquisition.guided.stillness import WiredEncoderWatch
from acquisition.motion.inverse.solve import AtPoint, refine, within
from acquisition.recording import Channel, Event, RecordingError, RecordingWriter, RigFileError
from acquisition.recording.rig import Rig
from acquisition.recording.rig.devices import EncodersDevice
from acquisition.wires.streams import Pump, Supervisor
from calibeam.devices.encoders import VIEWED, emulated_encoders, encoder_driver, identities_of, stamp_pace
from calibeam.devices.recorder import Interrupted, uninterrupted
from calibeam.guided.judge import FittedJudge
from calibeam.outcome import PartialResult, interruption
from calibrate.model.arms.rig_arm import RigArm
from drivers.clock import Clock
from drivers.device import stamps_of

Floats = NDArray[np.float64]
ARRIVED_M = 1e-6  # far below what a person can do


class AssumedGuidedArm(RigArm):
    """Implements acquisition.guided.stillness.GuidedArm."""

    def postures(self, start_rad: Floats, point_m: Floats) -> Floats:
        found = refine(self, AtPoint(self.point_m, point_m), start_rad, close=ARRIVED_M).q_rad
        return found[within(self, found)]


STREAM_MEMORY = 400  # blocks: some seconds, of which a dwell needs one


@dataclass(frozen=True)
class EncoderAddress:
    """Where the encoders are. `hurry`: device seconds in one second of this program's clock; 1 on site."""

    device: EncodersDevice
    hurry: float = 1.0


def is_guided(rig: Rig) -> bool:
    """Whether a session of this rig is one that a person's hand moves: artefacts to probe, encoders, and no robot."""
    devices = rig.devices
    probed = bool(rig.seat_list or rig.bar_position_list or rig.sphere_list)
    return probed and devices.encoders is not None and devices.robot is None and devices.psd is None


def encoder_address(rig: Rig, announced: Mapping[str, Any] | None = None, hurry: float = 1.0) -> EncoderAddress:
    """The rig's encoders, or the same where emulators announced their adapter. RigFileError where there are none."""
    device = rig.devices.encoders
    if device is None:
        raise RigFileError(f"rig {rig.name}: no [devices.encoders]; a measuring arm is read by its encoders")
    if announced is not None:
        return EncoderAddress(emulated_encoders(device, announced), hurry)
    return EncoderAddress(device, hurry)


@contextmanager
def watching(address: EncoderAddress, writer: RecordingWriter, clock: Clock) -> Generator[WiredEncoderWatch]:
    """The encoders connected and read into the recording until left; then the port is released."""
    driver = encoder_driver(address.device, clock, hurry=address.hurry)
    driver.connect()
    supervisor = Supervisor(lambda: None, clock)  # nothing to stop: a person moves the arm

    def failed(failure: Exception) -> None:
        supervisor.failed(failure)
        if not isinstance(failure, RecordingError):
            writer.event(Event(clock.now_s(), "device failed", {"device": driver.name, "why": str(failure)}))

    try:
        channels = tuple(Channel(c.name, c.unit, c.shape, c.full_scale, c.resolution) for c in driver.describe())
        stream = writer.stream(driver.name, channels, VIEWED, stamps=stamps_of(driver))
        writer.event(Event(clock.now_s(), "encoders", {"identities": identities_of(driver)}))
        pump = Pump(
            driver,
            clock,
            lambda block: stream.append(block.host_s, block.device_s, block.sequence, block.values),
            failed,
            memory=STREAM_MEMORY,
        )
    except BaseException:
        driver.close()
        raise
    pump.start()
    try:
        yield WiredEncoderWatch(pump, supervisor, stamp_pace(address.device, address.hurry))
    finally:
        with uninterrupted():
            pump.stop()


class GuidedJournal:
    """Implements acquisition.guided.session.GuidedJournal."""

    def __init__(self, writer: RecordingWriter, clock: Clock) -> None:
        self._writer, self._clock = writer, clock

    def readings(self, readings: Sequence[Reading]) -> None:
        for reading in readings:
            self._writer.sample(reading.row(), reading.host_s)

    def event(self, kind: str, detail: Mapping[str, Any]) -> None:
        self._writer.event(Event(self._clock.now_s(), kind, dict(detail)))


def record_guided(
    watch: WiredEncoderWatch,
    rig: Rig,
    guide: Guide,
    plan: tuple[GuidedVisit, ...],
    writer: RecordingWriter,
    clock: Clock,
    *,
    seed: int = 1,
    patience_s: float = np.inf,
) -> GuidedSummary:
    """Run the plan. PartialResult when it ended early: what was taken is kept."""
    judge, journal = FittedJudge(rig), GuidedJournal(writer, clock)
    rng = np.random.default_rng(seed)
    session = GuidedSession(watch, AssumedGuidedArm.of_rig(rig), guide, judge, journal, rng, patience_s=patience_s)
    try:
        summary = session.run(plan)
    except Interrupted as why:
        raise _ended_early(writer, clock, session, why) from why
    counts = {"slips": summary.slips, "doubted": summary.doubted, "skipped": summary.skipped}
    writer.event(Event(clock.now_s(), "end", {"samples": len(summary.readings), **counts}))
    return summary


def _ended_early(writer: RecordingWriter, clock: Clock, session: GuidedSession, why: BaseException) -> PartialResult:
    """Put what there is on the disk; a second Ctrl-C may not get in between."""
    reason = interruption(why) if isinstance(why, KeyboardInterrupt) else str(why)
    with uninterrupted():
        try:
            writer.event(Event(clock.now_s(), "ended early", {"why": reason}))
            writer.flush()
        except RecordingError as error:
            if str(error) != reason:
                reason = f"{reason}; {error}"
    kept = f"samples kept in {writer.path}: {session.taken}"
    if session.taken:
        kept += f"; `calibeam identify {writer.path}` fits them"
    return PartialResult(f"{reason}; {kept}")
