"""What was tested and rejected, what these poses cannot see, what was not recorded, faults of the file."""

from collections.abc import Iterator, Sequence

from calibrate.diagnose.schema import DiagnosisFile, FindingRecord, NameRecord
from calibrate.report.diagnosis.words import (
    confusable_causes,
    hardest_to_see,
    place_words,
    size_of,
    stream_words,
    untested_physics,
)
from calibrate.report.elements import Html, bullets, folded, halves, section, table, tag
from calibrate.report.quantities import DASH, fixed, length, significant

TITLE = "Uncertainty and limits"
MOST_PAIRS = 40  # of confusable causes: the file holds them all


def limits(file: DiagnosisFile, held: Sequence[FindingRecord] = ()) -> Html:
    """Chapter `diagnosis-limits`; `held`: findings that the calibrated arm of the page holds already."""
    lead = "What could be there and was not found, or could not be."
    return section(
        "diagnosis-limits",
        TITLE,
        lead,
        *_unexplained(file),
        *_listed("Found as well, and part of the calibrated arm already", [f.says for f in held]),
        *_listed("Not completed", [f"{one.stage}: {one.reason}" for one in file.incomplete]),
        *_listed("Faults of the file", [b.says for b in file.blunders]),
        *_streams(file),
        *_listed("Derived, not recorded", list(file.derived)),
        *_missing(file),
        *_visible(file),
        *_rejected(file),
        *_invisible(file.invisible),
        *_confusable(file),
    )


def _unexplained(file: DiagnosisFile) -> Iterator[Html]:
    rows = [
        (u.where or "somewhere", u.says, f"{fixed(100.0 * u.share, 0)} %", _length(u.rms_m), significant(u.p, 2))
        for u in (file.unexplained, *file.also_unexplained)
        if u is not None
    ]
    if rows:
        head = ("Where", "what", "of the variance", "rms", "p")
        yield table(head, rows, numeric=(2, 3, 4), caption="There, and without a name")


def _listed(title: str, lines: Sequence[str]) -> Iterator[Html]:
    if lines:
        yield tag("h3", title)
        yield bullets(lines)


def _streams(file: DiagnosisFile) -> Iterator[Html]:
    """What the streams usually show says nothing about the arm: one line, the rest to open."""
    lines = list(stream_words(file))
    if lines:
        notes = "1 note, none of it a finding" if len(lines) == 1 else f"{len(lines)} notes, none of them a finding"
        yield folded(f"In the streams: {notes}", bullets(lines), on_paper=False)


def _missing(file: DiagnosisFile) -> Iterator[Html]:
    """Physics of which no form was tested, apart from physics that another column could show."""
    untested = untested_physics(file)
    apart = {
        "Not tested: columns that are missing": [m for m in file.not_recorded if m.physics in untested],
        "Tested with other columns; these would add to it": [m for m in file.not_recorded if m.physics not in untested],
    }
    for caption, listed in apart.items():
        if listed:
            rows = [(m.column, m.driver, m.physics) for m in listed]
            yield table(("Column", "driver", "physics"), rows, caption=caption)


def _visible(file: DiagnosisFile) -> Iterator[Html]:
    if not file.smallest:
        return
    hardest = [
        (one.physics, one.where, size_of(one.parameter, one.value), one.parameter) for one in hardest_to_see(file)
    ]
    head = ("Physics", "where it is seen worst", "found from", "of")
    caption = "Detection limits of these poses (95 %): a smaller error would not be found"
    yield halves(table(head, hardest, numeric=(2,), caption=caption))
    every = [(one.where, one.physics, size_of(one.parameter, one.value), one.parameter) for one in file.smallest]
    title = f"The same at every place: {len(every)} causes"
    listed = table(("Where", "physics", "found from", "of"), sorted(every), numeric=(2,))
    yield folded(title, listed, on_paper=False)


def _rejected(file: DiagnosisFile) -> Iterator[Html]:
    if file.rejected:
        rows = [(place_words(r), DASH if r.bic_gain is None else fixed(r.bic_gain, 1), r.why) for r in file.rejected]
        head = ("Best candidate of its kind", "BIC gain", "why not")
        title = f"Tested and rejected: {len(rows)} kinds of cause"
        yield folded(title, table(head, rows, numeric=(1,)), on_paper=False)


def _invisible(names: Sequence[NameRecord]) -> Iterator[Html]:
    if names:
        title = f"Invisible with these poses: {len(names)} causes that geometry would swallow"
        yield folded(title, bullets(place_words(name) for name in names))


def _confusable(file: DiagnosisFile) -> Iterator[Html]:
    pairs = confusable_causes(file)
    if pairs:
        ranked = pairs[:MOST_PAIRS]
        rows = [(place_words(a), place_words(b), f"{r2:.3f}") for a, b, r2 in ranked]
        more = len(pairs) - len(ranked)
        title = f"Cannot be separated with these poses: {len(pairs)} pair{'s' if len(pairs) > 1 else ''} of causes"
        note = (tag("p", f"{more} more in diagnosis.json."),) if more else ()
        yield folded(title, table(("One cause", "another", "R²"), rows, numeric=(2,)), *note, on_paper=False)


def _length(value_m: float | None) -> str:
    return DASH if value_m is None else length(value_m)
