"""The chapter that lets a result be traced: versions, seeds, the rig to the letter."""

from collections.abc import Sequence

from acquisition.recording import Recording
from acquisition.recording.rig import rig_sha256
from calibrate.report.elements import Html, facts, folded, section, tag
from calibrate.report.quantities import significant

TITLE = "Provenance"


def provenance(
    recording: Recording, used: int, used_because: str, identified_by: str, extra: Sequence[tuple[str, str]] = ()
) -> Html:
    """Everything needed to do it again; `used` samples, and why these: "300, of which 290 with both spots"."""
    samples = recording.samples
    span_s = float(samples.column("t_s").max() - samples.column("t_s").min()) if len(samples) else 0.0
    pairs = [
        ("recording", recording.path.name),
        ("state", _state(recording)),
        ("settled samples", f"{len(samples)}, of which {used} {used_because}, over {significant(span_s)} s"),
        ("started (UTC)", recording.started_utc or "not stated"),
        ("recorded by", _by(recording)),
        ("identified by", identified_by),
        *extra,
        ("rig", recording.rig.name),
        ("rig SHA-256", rig_sha256(recording.rig_text)),
        *((f"note: {name}", text) for name, text in recording.notes.items()),
    ]
    rig_text = folded("Rig file, as recorded", tag("pre", recording.rig_text), on_paper=False)
    return section("provenance", TITLE, "What it takes to do it again.", facts(pairs), rig_text)


def _state(recording: Recording) -> str:
    return "complete" if recording.complete else "cut short or damaged"


def _by(recording: Recording) -> str:
    software = recording.software or "not stated"
    return f"{software} on {recording.host}" if recording.host else software
