"""What is examined in streams, and how each examination ended: a record for every joint or device it has.

A new examination is one function here and one line in STREAM_EXAMINATIONS.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtri

from acquisition.recording.examination import Examination, ExaminationRecord
from calibrate.diagnose.streams import limits
from calibrate.diagnose.streams.angle_offsets import AngleOffset
from calibrate.diagnose.streams.clock import ClockFit
from calibrate.diagnose.streams.continuity import Fault
from calibrate.diagnose.streams.deflection import Deflection
from calibrate.diagnose.streams.following import Following
from calibrate.diagnose.streams.recorded import StreamDevice
from calibrate.diagnose.streams.settling import Stand, Window
from calibrate.diagnose.streams.track import Outcome, white_noise

if TYPE_CHECKING:
    from calibrate.diagnose.streams.stream_findings import StreamFinding

Records = Iterator[ExaminationRecord]
FEWEST_ROWS = 3
NO_JOINTS = "no angles of the joints were recorded"


@dataclass(frozen=True, eq=False)
class StreamsSeen:
    """What the finders were given and what they found; empty where they could not begin."""

    devices: Mapping[str, StreamDevice]
    findings: "tuple[StreamFinding, ...]"
    clocks: Mapping[str, ClockFit] = field(default_factory=dict[str, ClockFit])
    behind: Sequence[Following] = ()
    offsets: Mapping[str, tuple[AngleOffset, ...]] = field(default_factory=dict[str, tuple[AngleOffset, ...]])
    bent: Sequence[Deflection] = ()
    slips_judged: Sequence[bool] = ()
    stands: Sequence[Stand] = ()
    windows: Sequence[Window] | None = None
    silent: Mapping[int, str] = field(default_factory=dict[int, str])  # joint -> how often its second encoder answered
    stated: frozenset[str] = frozenset()  # devices that the rig file states

    def sentences(self, *physics: str, stream: str = "", where: str = "") -> str:
        """What was found of these kinds, one sentence after the other; empty: nothing."""
        mine = (f for f in self.findings if f.name.physics in physics and stream in ("", f.stream))
        return "; ".join(f.says for f in mine if where in ("", f.name.where))

    def missing(self, *needed: str) -> str:
        """Which of these devices was not recorded, or holds no valid row, in words; empty: all are there."""
        absent = [NAMES[name] for name in needed if name not in self.devices]
        if absent:
            return f"not recorded: {', '.join(absent)}"
        empty = [NAMES[name] for name in needed if not np.isfinite(self.devices[name].track.values).any()]
        return f"without one valid reading: {', '.join(empty)}" if empty else ""

    def expects(self, *about: str) -> bool:
        """Whether one of the devices that an examination is about was recorded, or is one of the rig's."""
        return any(name in self.devices or name in self.stated for name in about)


NAMES = {
    "command": "set-points (cmd)",
    "joints": "angles of the joints (q)",
    "encoders": "second encoders (enc)",
    "spots": "photocurrents of the detectors",
    "torque": "torques of the joints (tau)",
}

CONTINUITY = Examination(
    "continuity of the streams", ("device_s", "sequence"), "record three rows or more with time stamps that rise"
)
FOLLOWING = Examination(
    "following error", ("cmd", "q"), "record set-points and readings while every joint moves for some seconds"
)
OFFSET = Examination(
    "offset from the set-point",
    ("cmd", "q"),
    "record set-points and readings of ten seconds or more in which the arm moves",
)
CLOCK = Examination(
    "clock of encoders", ("enc", "q"), "record both encoders of the joints over ten seconds or more of motion"
)
SECOND = Examination(
    "offset of the second encoders", ("enc", "q"), "record both encoders of the joints over ten seconds of motion"
)
SLIPS = Examination(
    "slips of the second encoders", ("enc", "q"), "record a motion with ten stands or more, or a longer one"
)
COMPLIANCE = Examination(
    "joint compliance between encoders",
    ("enc", "q", "tau"),
    "record torques (tau) beside both encoders over half a minute of motion",
)
RINGING = Examination(
    "ringing after stops", ("q",), "record a motion that stops for a second or longer at several poses"
)
SPOTS = Examination(
    "clock of spots", ("photocurrents", "q"), "diagnose a recording with settled samples of the detectors"
)
SETTLED = Examination(
    "samples taken unsettled",
    ("photocurrents", "sample events"),
    "record the session with `calibeam session`, which keeps when each sample was averaged",
)


PAIRS = Examination(
    "encoders against each other",
    ("position_rad",),
    "`calibeam check LOG` states pace, eccentricity, slips and noise of the encoders",
)


ANSWERING = "record encoders that answer: check wiring, nodes and the signals of the DBC"


def _silent(examination: Examination, seen: StreamsSeen) -> Records:
    """Of second encoders that took no part, since they hardly answered."""
    for joint, why in seen.silent.items():
        yield examination.not_examined(why, f"joint{joint}", remedy=ANSWERING)


def _continuity(seen: StreamsSeen) -> Records:
    if not seen.devices:
        yield CONTINUITY.not_examined("no stream was recorded", expected=False)
    for name, device in seen.devices.items():
        rows, period_s = len(device.track.time_s), device.track.period_s
        found = seen.sentences(*(fault.value for fault in Fault), stream=device.track.name)
        if found:
            yield CONTINUITY.found(found, name)
        elif rows < FEWEST_ROWS:
            yield CONTINUITY.not_examined(f"only {rows} rows", name)
        elif not (np.isfinite(period_s) and period_s > 0.0):
            yield CONTINUITY.not_examined("the time stamps do not rise", name)
        else:
            yield CONTINUITY.nothing(1.0, "missing row", name)


def _following(seen: StreamsSeen) -> Records:
    why = seen.missing("command", "joints")
    if why or not seen.behind:
        yield FOLLOWING.not_examined(why or NO_JOINTS, expected=seen.expects("command"))
        return
    for one in seen.behind:
        where = f"joint{one.joint}"
        if one.outcome is Outcome.FOUND:
            yield FOLLOWING.found(seen.sentences("following-error", where=f"{where}.angle"), where)
        elif one.behind_sigma_s is None or not np.isfinite(one.behind_sigma_s):
            yield FOLLOWING.not_examined(one.why or "the motion does not determine it", where)
        else:
            sigmas = float(-ndtri(0.5 * limits.FOLLOWING_ALPHA))
            yield FOLLOWING.nothing(max(sigmas * one.behind_sigma_s, limits.BEHIND_S), "s", where)


def _offset(seen: StreamsSeen) -> Records:
    why = seen.missing("command", "joints")
    if why:
        yield OFFSET.not_examined(why, expected=seen.expects("command"))
        return
    yield from _of_offsets(OFFSET, "joints", seen)


def _of_offsets(examination: Examination, stream: str, seen: StreamsSeen) -> Records:
    for one in seen.offsets.get(stream, ()):
        where = f"joint{one.joint}"
        found = seen.sentences("angle-offset", "droop", "encoder-eccentricity", stream=stream, where=f"{where}.angle")
        if found:
            yield examination.found(found, where)
        elif one.why or one.limit_rad is None:
            yield examination.not_examined(one.why, where)
        else:
            against_zero = stream == "encoders" and not one.zeroless  # where discs off their centres may do as much
            discs_rad = limits.OFFSET_SIGMAS * limits.USUAL_DISC_RAD if against_zero else 0.0
            yield examination.nothing(max(one.limit_rad, discs_rad), "rad", where)


def _clock(seen: StreamsSeen) -> Records:
    why, clock = seen.missing("encoders", "joints"), seen.clocks.get("encoders")
    yield _of_clock(CLOCK, "encoders", why, clock, seen, expected=seen.expects("encoders"))


def _of_clock(
    examination: Examination, name: str, why: str, clock: ClockFit | None, seen: StreamsSeen, *, expected: bool
) -> ExaminationRecord:
    found = seen.sentences("latency", stream=name)
    if found:
        return examination.found(found)
    if why or clock is None:
        return examination.not_examined(why or NO_JOINTS, expected=expected)
    if clock.offset_sigma_s is None:
        return examination.not_examined(clock.status.value, expected=expected)
    return examination.nothing(max(limits.LATE_SIGMAS * clock.offset_sigma_s, limits.LATE_S), "s")


def _second(seen: StreamsSeen) -> Records:
    yield from _silent(SECOND, seen)
    why, offsets = seen.missing("encoders", "joints"), seen.offsets.get("encoders", ())
    if why or not offsets:
        clock = seen.clocks.get("encoders")
        yield SECOND.not_examined(
            why or (NO_JOINTS if clock is None else f"clock: {clock.status.value}"), expected=seen.expects("encoders")
        )
        return
    yield from _of_offsets(SECOND, "encoders", seen)
    zeroless = [f"joint{one.joint}" for one in offsets if one.zeroless and not one.why]
    if zeroless:
        yield SECOND.not_examined(
            f"against the zero: the rig file states no zero of the second encoder of {', '.join(zeroless)}",
            expected=False,
            remedy="state `encoder_zero_rad` of the joints in the rig file, or compare with an earlier recording "
            "(`calibeam compare`)",
        )


def _slips(seen: StreamsSeen) -> Records:
    yield from _silent(SLIPS, seen)
    why, judged = seen.missing("encoders", "joints"), seen.slips_judged
    if why or not judged:
        clock = seen.clocks.get("encoders")
        yield SLIPS.not_examined(
            why or (NO_JOINTS if clock is None else f"clock: {clock.status.value}"), expected=seen.expects("encoders")
        )
        return
    track, offsets = seen.devices["encoders"].track, {one.joint: one for one in seen.offsets.get("encoders", ())}
    for channel, was_judged in enumerate(judged):
        joint = track.joint(channel)
        offset = offsets.get(joint)
        limit_rad = None if offset is None else offset.limit_rad
        found = seen.sentences("encoder-slip", where=f"joint{joint}.angle")
        if found:
            yield SLIPS.found(found, f"joint{joint}")
        elif limit_rad is not None:
            yield SLIPS.nothing(limit_rad, "rad", f"joint{joint}")
        elif was_judged:
            yield SLIPS.nothing(None, "", f"joint{joint}", "a step beyond the scatter from stand to stand")
        else:
            yield SLIPS.not_examined("too few stands, and its offset is not determined", f"joint{joint}")


def _compliance(seen: StreamsSeen) -> Records:
    why = seen.missing("encoders", "joints", "torque")
    if why or not seen.bent:
        both = seen.expects("encoders") and seen.expects("torque")
        yield COMPLIANCE.not_examined(why or "no clock of the second encoders", expected=both)
        return
    yield from _silent(COMPLIANCE, seen)
    for one in seen.bent:
        where = f"joint{one.joint}"
        if one.outcome is Outcome.FOUND:
            yield COMPLIANCE.found(seen.sentences("joint-compliance", where=f"{where}.angle"), where)
        elif one.sigma is None:
            yield COMPLIANCE.not_examined("the motion is too short, or too even", where)
        else:
            sigmas = float(-ndtri(0.5 * limits.DEFLECTION_ALPHA / len(seen.bent)))
            yield COMPLIANCE.nothing(sigmas * one.sigma, "rad/Nm", where)


def _ringing(seen: StreamsSeen) -> Records:
    why = seen.missing("joints")
    found = seen.sentences("ringing")
    if found:
        yield RINGING.found(found)
    elif why:
        yield RINGING.not_examined(why, expected=bool(seen.devices))
    else:
        track = seen.devices["joints"].track.read()
        lasting = [s for s in seen.stands if (s.to_s - s.from_s) > limits.RINGING_SAMPLES * track.period_s]
        if len(lasting) < 2 or not np.any(np.ptp(track.values, axis=0) > limits.STANDS_RAD):
            moves = len(track.time_s) > 0 and bool(np.any(np.ptp(track.values, axis=0) > limits.STANDS_RAD))
            why = "the arm does not stop after a motion for long enough" if moves else "no joint moves in a valid row"
            yield RINGING.not_examined(why, expected=not moves)
        else:
            noise = float(np.max(white_noise(track.values)))
            yield RINGING.nothing(max(noise, limits.FINEST_RAD), "rad")


def _clock_of_spots(seen: StreamsSeen) -> Records:
    why, clock = seen.missing("spots", "joints"), seen.clocks.get("spots")
    if not why and clock is None:
        why = "no fitted model predicts them during the motion"
    yield _of_clock(SPOTS, "spots", why, clock, seen, expected=seen.expects("spots"))


def _settled(seen: StreamsSeen) -> Records:
    why = seen.missing("spots")
    found = seen.sentences("not-settled")
    if found:
        yield SETTLED.found(found)
    elif why or not seen.windows:
        reason = why or "the recording has no averaging times of the samples"
        yield SETTLED.not_examined(reason, expected=seen.expects("spots"))
    else:
        noise = float(np.nanmax(white_noise(seen.devices["spots"].track.read().values)))
        if np.isfinite(noise):
            yield SETTLED.nothing(limits.MISSED_SIGMAS * noise, "m")
        else:
            yield SETTLED.not_examined("no stretch of valid readings")


STREAM_EXAMINATIONS: tuple[tuple[Examination, Callable[[StreamsSeen], Records]], ...] = (
    (CONTINUITY, _continuity),
    (FOLLOWING, _following),
    (OFFSET, _offset),
    (CLOCK, _clock),
    (SECOND, _second),
    (SLIPS, _slips),
    (COMPLIANCE, _compliance),
    (RINGING, _ringing),
    (SPOTS, _clock_of_spots),
    (SETTLED, _settled),
)


def stream_examinations(seen: StreamsSeen, *, arm: bool = True) -> tuple[ExaminationRecord, ...]:
    """The endings of all of them, in the order of the tuple; without an arm nothing is about its joints."""
    if not arm:
        return (*_continuity(seen), PAIRS.not_examined("it is a part of the check of a log", expected=False))
    return tuple(record for _, examine in STREAM_EXAMINATIONS for record in examine(seen))


def stream_examinations_left_out(reason: str, remedy: str) -> tuple[ExaminationRecord, ...]:
    """Of each of them that it did not take place, for one reason and with one remedy."""
    return tuple(one.not_examined(reason, remedy=remedy) for one, _ in STREAM_EXAMINATIONS)
