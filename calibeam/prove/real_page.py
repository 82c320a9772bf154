"""real.html: of each real recording what was found, what remains, and what was inferred of columns kept back."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from calibeam.prove.hidden_angle import HiddenAngle
from calibeam.prove.real import ROOM, RealScore
from calibrate.diagnose.schema import DiagnosisFile
from calibrate.report.diagnosis.words import verdict_words
from calibrate.report.elements import Html, bullets, figure, section, table, tag
from calibrate.report.page import page, write_page
from calibrate.report.quantities import DASH, angle, length
from calibrate.report.svg import drawn
from calibrate.report.tones import Tone

LEAD = (
    "Nobody knows the truth of a real recording. What counts is the error on samples that no fit has seen, and what is "
    "inferred of a column that the file has and the model was not given."
)
HEAD = ("", "samples", "unseen samples, geometry", "with what was found", "noise, as it is known", "found")
ANGLES = ("hidden", "poses", "inferred less recorded, rms", "doubt stated before", "poses that do not feel it")
DOUBT = 2.0  # sigmas that the figure shades
MOST = 6.0  # sigmas that it shows


def write_real_page(path: Path, sets: Sequence[RealScore], software: str) -> Path:
    """One HTML file at `path`, beside the pages of the sets; returns it. DataError where it cannot be written."""
    return write_page(path, real_html(sets, software))


def real_html(sets: Sequence[RealScore], software: str) -> str:
    """The page as text."""
    masthead = tag(
        "header",
        tag("p", "Real recordings, columns kept back", cls="kicker"),
        tag("h1", f"{len(sets)} real recordings"),
        tag("p", software, cls="byline"),
    )
    contents = {"sets": "All sets", **{one.name: one.name for one in sets}}
    return page("Real recordings", masthead, contents, [_all(sets), *map(_set, sets)], software)


def _all(sets: Sequence[RealScore]) -> Html:
    return section("sets", "All sets", LEAD, table(HEAD, [_row(one) for one in sets], numeric=(1, 2, 3, 4)))


def _row(one: RealScore) -> tuple[str, ...]:
    file = one.diagnosis
    if file is None:
        return (one.name, str(one.samples), f"failed: {one.error}")
    found = ", ".join(f"{f.physics} at {f.where}" for f in file.findings) or file.verdict
    return (one.name, str(one.samples), _m(file.rms_before_m), _m(file.rms_after_m), _m(file.noise_floor_m), found)


def _set(one: RealScore) -> Html:
    file = one.diagnosis
    if file is None:
        return section(one.name, one.name, f"The diagnosis failed: {one.error}.")
    said = [f.says for f in file.findings] + _unexplained(file)
    whole = tag("p", tag("a", "The whole diagnosis", href=f"{one.name}.html"), f" · {one.samples} samples")
    return section(one.name, one.name, verdict_words(file), bullets(said), whole, *_angles(one), *_room(one))


def _unexplained(file: DiagnosisFile) -> list[str]:
    left = [u for u in (file.unexplained, *file.also_unexplained) if u is not None]
    return [f"Unexplained: {u.says}" for u in left] or ["Nothing that remains has a structure that was seen."]


def _angles(one: RealScore) -> list[Html]:
    """Nothing where no joint could be hidden."""
    if not one.angles:
        return []
    rows = [
        (f"joint {a.joint}", str(a.poses), _rad(a.rms_rad), _rad(a.expected_rad), str(a.unfelt)) for a in one.angles
    ]
    caption = "Each joint in turn hidden at a fifth of the poses, inferred from what the instrument saw"
    found = [table(ANGLES, rows, numeric=(1, 2, 3, 4), caption=caption)]
    if any(a.misses for a in one.angles):
        says = f"Of {one.name}: hidden angles, inferred less recorded, by the doubt stated before."
        drawing = drawn(f"angles-{one.name}", says, 7.0, 2.6, lambda figure: _paint(figure, one.angles))
        found.append(figure(drawing, "Shaded: twice the stated doubt. Inside for 95 % if the doubt is a fair one."))
    return found


def _paint(figure: Figure, angles: Sequence[HiddenAngle]) -> None:
    axes = figure.subplots()
    axes.axhspan(-DOUBT, DOUBT, color=Tone.FAINT.value)
    for hidden in angles:
        n = len(hidden.misses)
        across = [hidden.joint + 0.7 * ((i + 0.5) / n - 0.5) for i in range(n)]
        axes.plot(across, hidden.misses, ".", color=Tone.PLACE_1.value, markersize=4.0)
        if not n:
            axes.text(hidden.joint, 0.0, "not felt", ha="center", va="center", color=Tone.SOFT.value, fontsize=8.0)
    axes.set(ylim=(-MOST, MOST), xlabel="hidden joint", ylabel="sigmas", xlim=(0.5, len(angles) + 0.5))
    axes.set_xticks([a.joint for a in angles])


def _room(one: RealScore) -> list[Html]:
    """What was said without the room's temperature, where the file has it."""
    if one.blind is None or one.diagnosis is None:
        return []
    with_it, without = ([f"{f.physics} at {f.where}" for f in file.findings] for file in (one.diagnosis, one.blind))
    same = "the same" if with_it == without else ", ".join(without) or one.blind.verdict
    lines = [f"Diagnosed once more without {ROOM}: {same}."]
    lines += [
        f"{c.physics} at {c.where} was found to change with time; its course and the hidden temperature: correlation "
        f"{c.correlation:.2f}."
        for c in one.columns
    ]
    if not one.columns:
        lines.append("Nothing was found that changes with time, so nothing was inferred of the temperature.")
    return [bullets(lines)]


def _m(value: float | None) -> str:
    return DASH if value is None else length(value)


def _rad(value: float | None) -> str:
    return DASH if value is None else angle(value)
