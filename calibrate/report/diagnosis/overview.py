"""The first page of a diagnosis, and the page on its limits.

First: whether recording and model agree, what was found, how well it is proved, what it changes. Limits: what was
tested and rejected, what these poses cannot show, missing columns, faults of the file.
"""

from collections.abc import Iterator, Sequence

from acquisition.recording.examination import NOT_EXAMINED_LINE, not_examined_lines
from calibrate.diagnose.record.schema import DiagnosisFile, FindingRecord, NameRecord
from calibrate.quantities import (
    DASH,
    counted,
    fixed,
    length,
    significant,
)
from calibrate.report.diagnosis.words import (
    SPLITS,
    confusable_causes,
    free_space_words,
    hardest_to_see,
    place_words,
    size_of,
    stream_words,
    untested_physics,
    verdict_words,
)
from calibrate.report.elements.html import (
    Html,
    bullets,
    folded,
    halves,
    section,
    table,
    tag,
    tile,
)
from calibrate.report.elements.verdict import Trust

TITLE = "What the model lacks"
TRUST = {"mismatch": Trust.CARE, "consistent": Trust.GOOD, "undecidable": Trust.NONE}


def overview(file: DiagnosisFile) -> Html:
    """Chapter `diagnosis`."""
    lead = (
        "Every element of the chain is tested for an error that explains what geometry cannot. Only what also "
        "predicts held-out samples is reported."
    )
    parts = [_verdict(file), _tiles(file)]
    if file.splits:
        parts.append(_proof(file))
    return section("diagnosis", TITLE, lead, *parts, *_fit(file))


def _verdict(file: DiagnosisFile) -> Html:
    content = [tag("strong", verdict_words(file))]
    if file.findings:
        content.append(
            bullets(tag("a", finding.says, href=f"#finding-{i}") for i, finding in enumerate(file.findings, start=1))
        )
    if file.next:
        content += [tag("p", tag("b", "What to do")), bullets(file.next)]
    return tag("div", *content, cls=f"verdict {TRUST[file.verdict].css}")


def _tiles(file: DiagnosisFile) -> Html:
    unseen = "rms of a coordinate, on samples that were left out"
    tiles = [
        tile("Unseen readings, geometry alone", _length(file.rms_before_m), unseen),
        tile("Unseen readings, with the physics", _length(file.rms_after_m), unseen),
        tile("Noise floor", _length(file.noise_floor_m), file.noise_floor_source or "not known"),
    ]
    if file.free_space is not None:
        change = file.free_space
        said = (
            f"{length(change.rms_before_m)} with geometry alone; predicted rms between the joint angles of the "
            "session, base and tool point fitted"
        )
        tiles.insert(0, tile("Tool error, with the physics", length(change.rms_after_m), said))
    return tag("div", *tiles, cls="tiles")


def _proof(file: DiagnosisFile) -> Html:
    floors = {f.instrument: f.rms_m for f in file.floors}
    rows = [
        (
            SPLITS.get(s.split, s.split),
            s.instrument,
            str(s.observations),
            _length(s.rms_before_m),
            _length(s.rms_after_m),
            _length(floors.get(s.instrument)),
            _interval(s.removed_low, s.removed_high),
        )
        for s in file.splits
    ]
    head = (
        "Held out",
        "instrument",
        "readings",
        "geometry alone",
        "with the physics",
        "noise floor",
        "removed of the squares",
    )
    return table(
        head, rows, numeric=range(2, 7), caption="Proof on samples that neither fit has seen: rms of a coordinate"
    )


def _fit(file: DiagnosisFile) -> Iterator[Html]:
    if file.rms_after_m is not None and file.noise_floor_m:
        yield tag("p", f"Explained down to {significant(file.rms_after_m / file.noise_floor_m)} times the noise floor.")
    if file.lack_of_fit is None:
        yield tag("p", "Lack of fit: too few poses were repeated to separate misfit from noise.")
    else:
        misfit = file.lack_of_fit
        reads = "something repeatable is still unexplained" if misfit.significant else "repeats show nothing more"
        yield tag(
            "p",
            f"Lack of fit: the misfit of {misfit.groups} repeated poses is {significant(misfit.ratio)} times their "
            f"scatter (p = {significant(misfit.p, 2)}): {reads}.",
        )
    if file.noise_wanders:
        yield tag("p", "The noise drifts slowly; causes that grow with time were tested against that drift, too.")
    if file.free_space is not None:
        yield tag("p", f"Tool error: {free_space_words(file.free_space)}.")


def _length(value_m: float | None) -> str:
    return DASH if value_m is None else length(value_m)


def _interval(low: float | None, high: float | None) -> str:
    """95 % of the paired bootstrap."""
    if low is None or high is None:
        return DASH
    return f"{fixed(100.0 * low, 0)} to {fixed(100.0 * high, 0)} %"


LIMITS_TITLE = "Uncertainty and limits"
MOST_PAIRS = 40  # of confusable causes: the file holds them all


def limits(file: DiagnosisFile, held: Sequence[FindingRecord] = ()) -> Html:
    """Chapter `diagnosis-limits`; `held`: findings that the calibrated arm of the page holds already."""
    lead = "What could be there and was not found, or could not be."
    left = [line.removeprefix(NOT_EXAMINED_LINE) for line in not_examined_lines(file.examinations)]
    return section(
        "diagnosis-limits",
        LIMITS_TITLE,
        lead,
        *_unexplained(file),
        *_listed("Found as well, and part of the calibrated arm already", [f.says for f in held]),
        *_listed("Not completed", [f"{one.stage}: {one.reason}" for one in file.incomplete]),
        *_listed("Not examined", left),
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
        (u.where or "somewhere", u.says, f"{fixed(100.0 * u.share, 0)} %", _length_of(u.rms_m), significant(u.p, 2))
        for u in (file.unexplained, *file.also_unexplained)
        if u is not None
    ]
    if rows:
        head = ("Where", "what", "of the variance", "rms", "p")
        yield table(head, rows, numeric=(2, 3, 4), caption="Found, but not explained by a known cause")


def _listed(title: str, lines: Sequence[str]) -> Iterator[Html]:
    if lines:
        yield tag("h3", title)
        yield bullets(lines)


def _streams(file: DiagnosisFile) -> Iterator[Html]:
    """What the streams usually show is nothing about the arm: one line, the rest to open."""
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
    title = f"The same wherever it can act: {len(every)} causes"
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
        title = f"Not visible with these poses: {len(names)} causes that geometry takes up"
        yield folded(title, bullets(place_words(name) for name in names))


def _confusable(file: DiagnosisFile) -> Iterator[Html]:
    pairs = confusable_causes(file)
    if pairs:
        ranked = pairs[:MOST_PAIRS]
        rows = [(place_words(a), place_words(b), f"{r2:.3f}") for a, b, r2 in ranked]
        more = len(pairs) - len(ranked)
        title = f"Cannot be separated with these poses: {counted(len(pairs), 'pair')} of causes"
        note = (tag("p", f"{more} more in diagnosis.json."),) if more else ()
        yield folded(title, table(("One cause", "another", "R²"), rows, numeric=(2,)), *note, on_paper=False)


def _length_of(value_m: float | None) -> str:
    return DASH if value_m is None else length(value_m)
