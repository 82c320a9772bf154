"""What the streams show, in the record that diagnosis.json holds.

Missing samples and the way in which every servo follows its set-point are reported with their size, but are no reason
to question the model: they stand beside the findings, and do not decide the verdict.
"""

import math

from msgspec.structs import replace

from calibrate.diagnose.doubts.diagnosis import NAMED, Named, Verdict
from calibrate.diagnose.record.schema import (
    ClockRecord,
    DiagnosisFile,
    FindingRecord,
    RivalRecord,
    SizeRecord,
    StreamsRecord,
)
from calibrate.diagnose.streams.clock import ClockFit
from calibrate.diagnose.streams.examine import StreamReport
from calibrate.diagnose.streams.finding import StreamFinding

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
}


def with_streams(file: DiagnosisFile, report: StreamReport | None) -> DiagnosisFile:
    """The diagnosis with what its recording's streams show; findings of the samples stay in front."""
    if report is None:
        return file
    told = [_finding(one) for one in report.findings if not _known(one, file)]
    faults = tuple(one for one in told if one.physics not in USUAL)
    streams = StreamsRecord(
        len(report.stands),
        tuple(_clock(name, fit) for name, fit in report.clocks.items()),
        tuple(one for one in told if one.physics in USUAL),
        report.unseen,
    )
    parted = faults and file.verdict == Verdict.CONSISTENT.value
    verdict = Verdict.MISMATCH.value if parted else file.verdict
    return replace(file, verdict=verdict, findings=file.findings + faults, streams=streams)


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
