"""The page of a reconciliation: before, what was left out, after with the same picture, what remains."""

import math
from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from acquisition.recording.rig import Rig
from calibeam.software import SOFTWARE
from calibrate.compare.reconciled_rows import AGREES, BEYOND, ReconcileFile, RowRecord, UnseenRowsRecord
from calibrate.quantities import length, significant
from calibrate.report.diagnosis import chain_figure, chain_of
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
from calibrate.report.elements.svg import drawn, log_axis
from calibrate.report.elements.tones import Tone

CONTENTS = {
    "before": "Before",
    "left-out": "What the simulation lacks",
    "after": "After",
    "torques": "Torques of the motion",
    "remains": "What remains",
}
SMALLEST_M = 1e-12  # of a row that a logarithmic axis can show
CHAINS = 3  # pictures of the chain: the first differences


def write_reconciliation_page(path: Path, file: ReconcileFile, rig: Rig, first_link: str | None) -> Path:
    """One HTML file at `path`; returns it. DataError where it cannot be written."""
    return write_page(path, reconciliation_html(file, rig, first_link))


def reconciliation_html(file: ReconcileFile, rig: Rig, first_link: str | None) -> str:
    """The page as text; `first_link`: where the two differ first."""
    masthead = tag(
        "header",
        tag("p", "A simulation and a recording", cls="kicker"),
        tag("h1", rig.name),
        tag("p", f"{file.measured} · {file.simulation} · {SOFTWARE}", cls="byline"),
    )
    verdict = tag("div", tag("strong", file.says), cls=f"verdict {'good' if file.verdict == 'agree' else 'care'}")
    contents, chapters = (
        CONTENTS,
        (verdict, _before(file, first_link), _left_out(file, len(rig.arm.joints)), _after(file), _remains(file)),
    )
    if file.torques and not file.unseen:
        contents = {name: CONTENTS[name] for name in ("left-out", "torques", "remains")}
        chapters = verdict, _left_out(file, len(rig.arm.joints)), _torques(file), _remains(file)
    elif file.torques:
        chapters = (*chapters[:-1], _torques(file), chapters[-1])
    else:
        contents = {name: says for name, says in CONTENTS.items() if name != "torques"}
    if not file.seen:
        contents, chapters = {"remains": CONTENTS["remains"]}, (verdict, _remains(file))
    return page(f"Reconciliation of {file.measured}", masthead, contents, chapters, SOFTWARE, kind="reconciliation")


def _before(file: ReconcileFile, first_link: str | None) -> Html:
    where = f" They differ first at the {first_link}." if first_link else ""
    lead = (
        f"Measured less simulated on {len(file.unseen_rows)} rows that nothing was fitted to; where the measuring "
        f"device stands is taken into account.{where}"
    )
    tiles = [
        tile(one.instrument, length(one.before_m), f"rms of a coordinate, {significant(one.before)} times the noise")
        for one in file.unseen
    ]
    return section("before", CONTENTS["before"], lead, tag("div", *tiles, cls="tiles"), *_pictures(file, "before"))


def _left_out(file: ReconcileFile, joints: int) -> Html:
    lead = "Each difference with its size and one sigma, and what else would explain it."
    if not file.left_out:
        return section("left-out", CONTENTS["left-out"], lead, tag("p", "Nothing that these samples show."))
    rows = [(one.where or "-", one.physics, one.says, ", ".join(one.alternatives) or "none") for one in file.left_out]
    listed = table(("Where", "what", "how much", "alternatives"), rows)
    instruments = tuple(one.instrument for one in file.unseen)
    chain = chain_of(joints, instruments)
    places = list(dict.fromkeys(one.where for one in file.left_out if one.where))[:CHAINS]
    shown = [figure(chain_figure(f"place{i}", where, chain), where) for i, where in enumerate(places)]
    return section("left-out", CONTENTS["left-out"], lead, listed, *((panels(*shown),) if shown else ()))


def _after(file: ReconcileFile) -> Html:
    lead = (
        "The same rows on the same scale: the simulation now has the geometry and the physics that were found. After "
        "geometry: the geometry alone, with the physics that the simulation had."
    )
    rows = [
        (
            one.instrument,
            str(one.rows),
            *(
                f"{length(value)} ({significant(over)})"
                for value, over in (
                    (one.before_m, one.before),
                    (one.geometry_m, one.geometry),
                    (one.after_m, one.after),
                )
            ),
            f"{length(one.noise_m)}, {one.noise_from}",
            "not stated" if one.stated_m is None else length(one.stated_m),
        )
        for one in file.unseen
    ]
    head = ("Instrument", "unseen rows", "before", "after geometry", "after physics", "noise", "stated noise")
    listed = table(head, rows, numeric=range(1, 5), caption="rms of a coordinate, and how many times the noise")
    return section("after", CONTENTS["after"], lead, listed, *_pictures(file, "after"))


def _torques(file: ReconcileFile) -> Html:
    lead = (
        "Measured less expected torque on the end of the motion, which nothing was fitted to, Nm rms; and how far the "
        "joints are from the recorded ones when the simulated arm follows the recorded set-points in closed loop."
    )
    states, joints = ("before", "links fitted", "with the physics"), file.torques
    torques = [(one.torque_nm, one.before_nm, one.links_nm, one.after_nm, one.noise_nm) for one in joints]
    replays = [(one.tracking_before_rad, one.tracking_links_rad, one.tracking_after_rad) for one in joints]
    parts = [_by_joint(file, ("torque", *states, "noise"), torques, 1.0, "torque, Nm rms")]
    if any(off is not None for one in replays for off in one):
        parts.append(_by_joint(file, states, replays, 1e3, "replay less recording, mrad rms"))
    return section("torques", CONTENTS["torques"], lead, *parts)


def _by_joint(
    file: ReconcileFile, head: Sequence[str], sizes: Sequence[Sequence[float | None]], factor: float, caption: str
) -> Html:
    rows = [
        (str(one.joint), *("-" if size is None else significant(factor * size) for size in each))
        for one, each in zip(file.torques, sizes, strict=True)
    ]
    return table(("Joint", *head), rows, numeric=range(len(head) + 1), caption=caption)


def _remains(file: ReconcileFile) -> Html:
    lead = (
        f"They agree where the unseen rows are within {AGREES} times the noise, within {BEYOND:.0f} times the stated "
        "noise or what repeated poses scatter, and a comparison finds nothing more."
    )
    parts = [bullets(file.remains) if file.remains else tag("p", "Nothing that these samples show.")]
    if file.next:
        parts += [tag("p", tag("b", "What to record next")), bullets(file.next)]
    if file.notes:
        parts += [tag("p", tag("b", "Beside")), bullets(file.notes)]
    return section("remains", CONTENTS["remains"], lead, *parts)


def _pictures(file: ReconcileFile, state: str) -> Sequence[Html]:
    out: list[Html] = []
    for one in file.unseen:
        rows = [row for row in file.rows if row.instrument == one.instrument]
        says = f"{one.instrument}: distance of each unseen row, {state}"
        name = f"{state}-{one.instrument}"
        drawing = drawn(name, says, 9.9, 2.6, lambda f, rows=rows, one=one: _paint(f, rows, one, state))
        caption = f"Each dot is one unseen row, {state}; the line is the noise. Both pictures have one scale."
        out.append(tag("div", figure(drawing, caption), cls="wide"))
    return out


def _paint(figure: Figure, rows: Sequence[RowRecord], one: UnseenRowsRecord, state: str) -> None:
    axes = figure.add_subplot()
    values = [row.before_m if state == "before" else row.after_m for row in rows]
    every = [value for row in rows for value in (row.before_m, row.after_m)]
    shown = [max(value, SMALLEST_M) for value in every if math.isfinite(value)]
    axes.plot([row.t_s for row in rows], values, "o", ms=4.0, color=Tone.BEAM.value)
    axes.axhline(one.noise_m, color=Tone.INK.value, lw=1.2)
    log_axis(axes, "y", [*shown, one.noise_m], length)
    axes.set(xlabel="time (s)", ylabel="measured less simulated")
