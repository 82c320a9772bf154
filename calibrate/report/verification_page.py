"""The page of a verification: conforms or not, every figure of the standards with its formula, every length."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure as Drawing

from acquisition.recording import Recording
from calibrate.quantities import (
    DASH,
    fixed,
    length,
    significant,
)
from calibrate.report.elements import html as elements
from calibrate.report.elements.html import (
    Html,
    bullets,
    figure,
    page,
    panels,
    section,
    table,
    tag,
    tile,
    write_page,
)
from calibrate.report.elements.svg import drawn
from calibrate.report.elements.tones import PLACES, Tone
from calibrate.report.elements.verdict import Trust
from calibrate.verify import Figure, Judgement, Verification

CONTENTS = {
    "figures": "Figures of the standards",
    "measurements": "Measurements",
    "provenance": elements.PROVENANCE_TITLE,
}
SAYS = {
    Judgement.CONFORMS: "conforms",
    Judgement.FAILS: "DOES NOT CONFORM",
    Judgement.NOT_STATED: "not judged: no limit stated",
    Judgement.NOT_MEASURED: "not measured",
}


def write_verification_page(path: Path | str, recording: Recording, found: Verification, software: str) -> Path:
    """One HTML file at `path`, over what may be there; returns it. DataError where it cannot be written."""
    return write_page(path, verification_html(recording, found, software))


def verification_html(recording: Recording, found: Verification, software: str) -> Html:
    """The page as text."""
    chapters = (
        _summary(found),
        _figures(found),
        _measurements(found),
        elements.provenance(recording, found.samples, "were read", software),
    )
    return page(
        f"Verification of {recording.rig.name}",
        _masthead(recording, found),
        CONTENTS,
        chapters,
        software,
        kind="verification",
    )


def _masthead(recording: Recording, found: Verification) -> Html:
    when = recording.started_utc.partition(".")[0].replace("T", " ")
    said = [f"{when} UTC"] if when else []
    said += [f"{found.samples} readings", "ISO 10360-12 and ASME B89.4.22"]
    return tag(
        "header",
        tag("p", "Verification of a measuring arm", cls="kicker"),
        tag("h1", recording.rig.name),
        tag("p", " · ".join(said), cls="byline"),
    )


def _summary(found: Verification) -> Html:
    measured = [one for one in found.figures if one.value is not None]
    tiles = [tile(one.symbol, length(one.value or 0.0), _against(one)) for one in measured]
    drawings = [figure(_shares(found), "Each figure over what is permitted; beyond the line it does not conform.")]
    lengths = next((one for one in measured if one.symbol == "E_Uni"), None)
    if lengths is not None:
        drawings.append(
            figure(_lengths(lengths), "Error of every length in the order measured, with what is permitted.")
        )
    return tag("div", _verdict(found), tag("div", *tiles, cls="tiles"), panels(*drawings), id="summary")


def _verdict(found: Verification) -> Html:
    trust = Trust.NONE if found.failed else Trust.GOOD if found.judged else Trust.CARE
    reasons = [f"{one.symbol}: {length(one.value or 0.0)}, permitted {_limit(one)}" for one in found.failed]
    reasons += [f"{one.symbol}: {one.judgement.value}" for one in found.figures if one not in found.judged]
    short = [one for one in found.judged if not one.complete]
    reasons += [f"{one.symbol}: {one.taken} of the {one.asked} measurements of the whole test" for one in short]
    reasons += found.left_out
    return tag(
        "div", tag("strong", found.sentence), *([bullets(reasons)] if reasons else []), cls=f"verdict {trust.css}"
    )


def _against(one: Figure) -> str:
    return f"{one.says}; permitted {_limit(one)}" if one.permitted is not None else f"{one.says}; no limit stated"


def _limit(one: Figure) -> str:
    return DASH if one.permitted is None else length(one.permitted)


def _figures(found: Verification) -> Html:
    rows = [
        (
            one.symbol,
            DASH if one.value is None else length(one.value),
            _limit(one),
            SAYS[one.judgement],
            f"{one.taken} of {one.asked}",
            f"{one.source.standard}, {one.source.section}: {one.source.formula}",
        )
        for one in found.figures
    ]
    head = ("Figure", "worst", "permitted", "judged", "taken", "standard and formula")
    lead = (
        "Sections are named by their titles. Fewer measurements than the standard asks for are part of its test: "
        "a figure within its limit then speaks for what was measured."
    )
    return section("figures", CONTENTS["figures"], lead, table(head, rows, numeric=(1, 2, 4)))


def _measurements(found: Verification) -> Html:
    tables = [
        table(
            ("Measurement", "value", "permitted"),
            [(says, length(value), DASH if limit is None else length(limit)) for says, value, limit in one.each],
            numeric=(1, 2),
            caption=f"{one.symbol}{_caption_end(one)}",
        )
        for one in found.figures
        if one.each
    ]
    return section("measurements", CONTENTS["measurements"], "What stands behind every figure.", *tables)


def _caption_end(one: Figure) -> str:
    return "".join(f"; {name} {length(value)}" for name, value in one.also)


def _shares(found: Verification) -> Html:
    judged = [(one.symbol, abs(one.value or 0.0) / one.permitted) for one in found.judged if one.permitted]
    says = "; ".join(f"{symbol} {significant(share, 2)} of what is permitted" for symbol, share in judged)

    def paint(drawing: Drawing) -> None:
        axes = drawing.add_subplot()
        places = np.arange(len(judged))[::-1]
        tones = [(Tone.PLACE_2 if share > 1.0 else Tone.PLACE_1).value for _, share in judged]
        axes.barh(places, [share for _, share in judged], color=tones, height=0.6)
        axes.axvline(1.0, color=Tone.INK.value, lw=1.2)
        axes.set_yticks(places, [symbol for symbol, _ in judged])
        axes.set(title="Found over permitted", xlim=(0.0, max([1.15, *(1.1 * share for _, share in judged)])))
        axes.grid(axis="y", visible=False)

    return drawn("verification-shares", says or "nothing was judged", 4.8, 3.3, paint)


def _lengths(one: Figure) -> Html:
    errors_um = [1e6 * value for _, value, _ in one.each]
    limits_um = [np.nan if limit is None else 1e6 * limit for _, _, limit in one.each]

    def paint(drawing: Drawing) -> None:
        axes = drawing.add_subplot()
        number = np.arange(1, len(errors_um) + 1)
        axes.plot(number, errors_um, "o", ms=4, mew=0, color=PLACES[0].value)
        for sign in (-1.0, 1.0):
            axes.step(number, sign * np.array(limits_um), where="mid", color=Tone.INK.value, lw=1.0)
        axes.axhline(0.0, color=Tone.SOFT.value, lw=0.8)
        axes.set(title="E_Uni: length error", xlabel="length, in the order measured", ylabel="µm")

    return drawn(
        "verification-lengths", f"length errors up to {fixed(max(map(abs, errors_um)), 1)} µm", 4.8, 3.3, paint
    )
