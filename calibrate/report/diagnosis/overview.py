"""The first page: do recording and model agree, what was found, how well it is proved, what it changes."""

from collections.abc import Iterator

from calibrate.diagnose.schema import DiagnosisFile
from calibrate.report.diagnosis.words import free_space_words, verdict_words
from calibrate.report.elements import Html, bullets, section, table, tag, tile
from calibrate.report.quantities import DASH, fixed, length, significant
from calibrate.report.verdict import Trust

TITLE = "What the model lacks"
TRUST = {"mismatch": Trust.CARE, "consistent": Trust.GOOD, "undecidable": Trust.NONE}
SPLITS = {"random": "samples at random", "place": "each place in turn", "last block": "the end of the session"}


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
    tiles = [
        tile("Geometry alone", _length(file.rms_before_m), "rms on samples held out"),
        tile("With the physics", _length(file.rms_after_m), "rms on the same samples"),
        tile("Noise floor", _length(file.noise_floor_m), file.noise_floor_source or "not known"),
    ]
    if file.free_space is not None:
        change = file.free_space
        said = f"{length(change.rms_before_m)} with geometry alone; predicted rms between these angles"
        tiles.append(tile("Tool error, frames fitted", length(change.rms_after_m), said))
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
    return table(head, rows, numeric=range(2, 7), caption="Proof on samples that neither fit has seen")


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
        yield tag("p", "The noise wanders slowly: causes that grow with time had to beat a wandering chance, too.")
    if file.free_space is not None:
        yield tag("p", f"Tool error: {free_space_words(file.free_space)}.")


def _length(value_m: float | None) -> str:
    return DASH if value_m is None else length(value_m)


def _interval(low: float | None, high: float | None) -> str:
    """95 % of the paired bootstrap."""
    if low is None or high is None:
        return DASH
    return f"{fixed(100.0 * low, 0)} to {fixed(100.0 * high, 0)} %"
