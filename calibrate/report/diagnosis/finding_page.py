"""One finding, one page: sentence, figure, place in the chain, size, proof, alternative explanations, what to do."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from calibrate.diagnose.record.schema import (
    CurveRecord,
    DiagnosisFile,
    FindingRecord,
    RivalRecord,
    SizeRecord,
)
from calibrate.model.sensors.catalogue import kind_of
from calibrate.model.sensors.kind import Trait
from calibrate.quantities import (
    DASH,
    TIED,
    decimals_of,
    fixed,
    significant,
)
from calibrate.report.diagnosis.words import place_words, unit_of
from calibrate.report.elements.html import (
    Html,
    facts,
    figure,
    panels,
    section,
    table,
    tag,
)
from calibrate.report.elements.svg import POINT_PX, drawn
from calibrate.report.elements.tones import Tone
from calibrate.report.figures.error_figures import thinned


@dataclass(frozen=True)
class Link:
    """A part of the chain; `ports` are the beginnings of the ports that sit in it."""

    name: str
    ports: tuple[str, ...]


def chain_of(joints: int, instruments: Sequence[str]) -> tuple[Link, ...]:
    """From the base to the readings of the instruments that were there."""
    out = [Link("clock", ("time",)), Link("base", ("base.",))]
    for i in range(1, joints + 1):
        out += [Link(f"J{i}", (f"joint{i}.",)), Link(f"link {i}", (f"link{i}.",))]
    out.append(Link("tool", ("tool.", "laser.")))
    traits = {trait for name in instruments for trait in kind_of(name).traits}
    if Trait.LIGHT in traits:
        out += [Link("fixture", ("fixture.",)), Link("PSD 1", ("psd1.",)), Link("PSD 2", ("psd2.",))]
    if Trait.CONES in traits:
        out.append(Link("cone", ("seat.",)))
    if Trait.DEVICE in traits:
        out.append(Link("device", ("device.",)))
    return tuple(out)


BOX_PT = (45.0, 30.0)  # of a link
ROW_PT = 44.0
WIDE_PT = 345.6  # 4.8 in, as the other figures of a panel


def chain_figure(name: str, where: str, chain: Sequence[Link]) -> Html:
    """With the link of the port `where` marked; written here, since a page has one of every finding."""
    per_row = _per_row(len(chain))
    rows, step = -(-len(chain) // per_row), WIDE_PT / per_row
    parts: list[Html] = []
    for at, link in enumerate(chain):
        x, y = (at % per_row + 0.5) * step, (at // per_row + 0.5) * ROW_PT
        marked = any(where.startswith(port) for port in link.ports)
        parts += _box(x, y, link.name, where.partition(".")[2] if marked else "")
        if at + 1 < len(chain):
            half = BOX_PT[0] / 2.0
            last = at % per_row == per_row - 1
            parts.append(
                _line(x, y + BOX_PT[1] / 2.0, 0.0, 4.0) if last else _line(x + half, y, step - 2.0 * half, 0.0)
            )
    size = f"0 0 {WIDE_PT} {rows * ROW_PT}"
    says = f"the chain from base to reading, {where} marked"
    style = f"max-width: {WIDE_PT * POINT_PX:.0f}px"
    return tag("svg", *parts, id=f"chain-{name}", viewBox=size, role="img", aria_label=says, style=style)


def _per_row(links: int) -> int:
    return -(-links // (-(-links // 6)))


def _box(x: float, y: float, name: str, port: str) -> list[Html]:
    tone, width = (Tone.BEAM, "2.2") if port else (Tone.SOFT, "0.8")
    at = {"x": f"{x - BOX_PT[0] / 2.0:.1f}", "y": f"{y - BOX_PT[1] / 2.0:.1f}"}
    size = {"width": f"{BOX_PT[0]}", "height": f"{BOX_PT[1]}", "rx": "5"}
    colour = Tone.BEAM if port else Tone.INK
    out = [tag("rect", **at, **size, fill="none", stroke=tone.css, stroke_width=width)]
    out.append(_text(x, y - (5.5 if port else 0.0), name, colour))
    return [*out, _text(x, y + 7.0, port, colour)] if port else out


def _text(x: float, y: float, says: str, tone: Tone) -> Html:
    font = {"font_family": "var(--sans)", "font_size": "10", "text_anchor": "middle", "dominant_baseline": "central"}
    return tag("text", says, x=f"{x:.1f}", y=f"{y:.1f}", fill=tone.css, **font)


def _line(x: float, y: float, right: float, down: float) -> Html:
    return tag("path", d=f"M{x:.1f} {y:.1f}l{right:.1f} {down:.1f}", stroke=Tone.SOFT.css, stroke_width="1.2")


Floats = NDArray[np.float64]

SHOWN = (0.5, 99.5)  # percentiles of the residual on the axis: where a port is hardly felt, points fly far
ROOM = 1.6  # times what is shown
MARGINS = {"left": 0.17, "right": 0.98, "bottom": 0.17, "top": 0.9}  # of the figure: five digits on the left
LINE_LEVELS = 6  # different driver values: below, the curve is a few levels and drawn as points


def pulled_figure(name: str, curve: CurveRecord, *, single: bool) -> Html:
    """`single`: the cause depends on the drawn driver alone, so that its curve is a line."""
    says = f"residual without this cause, pulled back to its place, against {curve.driver}, with the fitted curve"
    return drawn(f"pulled-{name}", says, 4.8, 3.3, lambda figure: _paint_curve(figure, curve, single=single), MARGINS)


def _paint_curve(figure: Figure, curve: CurveRecord, *, single: bool) -> None:
    axes = figure.add_subplot()
    x, y, fitted = (np.array(values, dtype=np.float64) for values in (curve.values, curve.residual, curve.fitted))
    scale, unit = _unit(curve.unit, float(np.nanmax(np.abs(fitted), initial=0.0)))
    turn, axis = _axis(curve.driver, x)
    shown = thinned(len(x))
    axes.axhline(0.0, color=Tone.SOFT.value, lw=0.8)
    axes.plot(
        turn * x[shown], scale * y[shown], "o", ms=2.6, mew=0, color=Tone.PLACE_1.value, alpha=0.5, label="samples"
    )
    order = np.argsort(x, kind="stable")
    style = "-" if single and len(np.unique(x)) >= LINE_LEVELS and _is_curve(x[order], fitted[order]) else "o"
    axes.plot(
        turn * x[order], scale * fitted[order], style, ms=3.0, mew=0, lw=2.0, color=Tone.BEAM.value, label="fitted"
    )
    reach = _reach(scale * y, scale * fitted)
    axes.set(xlabel=axis, ylabel=f"residual there ({unit})", ylim=(-reach, reach))
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, 1.12), ncols=2, borderaxespad=0.0)


def _is_curve(x: Floats, fitted: Floats) -> bool:
    """Whether neighbours have nearly the same value: a hidden driver would make it a cloud."""
    span = float(np.ptp(fitted))
    return span > 0.0 and float(np.median(np.abs(np.diff(fitted)))) < 0.1 * span and len(x) > 1


def _reach(y: Floats, fitted: Floats) -> float:
    known = y[np.isfinite(y)]
    most = float(np.max(np.abs(fitted), initial=0.0))
    if len(known):
        most = max(most, float(np.max(np.abs(np.percentile(known, SHOWN)))) / ROOM)
    return ROOM * max(most, 1e-12)


def _unit(unit: str, reach: float) -> tuple[float, str]:
    sizes = {"m": ((1e3, "mm"), (1e6, "µm")), "rad": ((1e3, "mrad"), (1e6, "µrad"))}[unit]
    return sizes[0] if reach * sizes[0][0] >= 1.0 else sizes[1]


def _axis(driver: str, x: Floats) -> tuple[float, str]:
    """Factor and label."""
    stem = driver.rstrip("0123456789")
    number = driver[len(stem) :]
    known = {
        "q": (np.degrees(1.0), f"joint {number} (°)"),
        "t": (1.0 / 60.0, "time (min)"),
        "gravity_torque": (1.0, f"gravity torque on joint {number} (Nm)"),
        "overturning_moment": (1.0, "overturning moment (Nm)"),
        "last_move": (np.degrees(1.0), f"last move of joint {number} (°)"),
        "qd": (np.degrees(1.0), f"speed of joint {number} (°/s)"),
        "cmd_minus_q": (np.degrees(1.0), f"command less reading, joint {number} (°)"),
        "approach": (1.0, f"way joint {number} came"),
        "spot": (1e3, f"distance of the spot from the middle of PSD {number} (mm)"),
        "incidence": (np.degrees(1.0), f"angle of the beam on PSD {number} (°)"),
        "payload": (1.0, "payload (kg)"),
        "reading": (1.0, "reading (m)"),
    }
    if stem.startswith("temp_"):
        return 1.0, f"temperature, {driver.removeprefix('temp_')} (°C)"
    return known.get(stem, (1.0, driver))


TWO_SIDED = 1.96  # sigmas of 95 %
SURE = 1e-6  # probability below which only its smallness is reported


def finding_page(number: int, finding: FindingRecord, file: DiagnosisFile, chain: Sequence[Link]) -> Html:
    """Chapter `finding-<number>`, from 1."""
    pictures = [figure(chain_figure(str(number), finding.where, chain), f"Where it sits: {finding.where}.")]
    if finding.curve is not None:
        caption = (
            "What the readings show of it, divided by how they feel this place; the line is the fitted curve. "
            "Readings that hardly feel it are left out."
        )
        single = "," not in finding.depends_on
        pictures.insert(0, figure(pulled_figure(str(number), finding.curve, single=single), caption))
    return section(
        f"finding-{number}",
        f"{number}. {finding.says}",
        finding.explains or "No physics of the catalogue fits it: only the dependence is reported.",
        panels(*pictures),
        _sizes(finding),
        facts(_proof(finding)),
        *_rivals(finding, file),
    )


def title_of(finding: FindingRecord) -> str:
    """For the contents."""
    return f"{finding.physics}, {finding.where}"


def _sizes(finding: FindingRecord) -> Html:
    rows = [(name, size_words(name, size), interval_words(name, size)) for name, size in finding.parameters.items()]
    head = ("Parameter", "size ± sigma", "95 % interval")
    return table(head, rows, numeric=(1, 2), caption=place_words(finding))


def size_words(name: str, size: SizeRecord) -> str:
    """With a unit that fits, from the unit in the name."""
    if size.value is None or size.sigma is None:
        return DASH
    factor, unit = unit_of(name, size.value)
    decimals = decimals_of(factor * size.sigma)
    value, sigma = fixed(factor * size.value, decimals), fixed(factor * size.sigma, decimals)
    return f"{value}{TIED}±{TIED}{sigma}{unit}"


def interval_words(name: str, size: SizeRecord) -> str:
    """'40.6 to 46.5 µrad per rad'; a dash for what was counted."""
    if size.value is None or size.sigma is None or not size.sigma > 0.0:
        return DASH
    factor, unit = unit_of(name, size.value)
    decimals, half = decimals_of(factor * size.sigma), TWO_SIDED * factor * size.sigma
    return f"{fixed(factor * size.value - half, decimals)} to {fixed(factor * size.value + half, decimals)}{unit}"


def _proof(finding: FindingRecord) -> Iterator[tuple[str, str]]:
    if finding.stream is not None:
        yield "found in", f"the stream of {finding.stream}{_when(finding)}"
    if finding.share is not None:
        yield "share of what all findings explain", f"{fixed(100.0 * finding.share, 0)} %"
    if finding.plausible_to is not None and finding.parameters:
        name = next(iter(finding.parameters))
        factor, unit = unit_of(name, finding.plausible_to)
        yield "a machine shows at most", f"{significant(factor * finding.plausible_to)}{unit}"
    yield "confidence in the name", f"{finding.confidence:.3f}"
    chance = f"below {significant(SURE, 1)}" if finding.p < SURE else significant(finding.p, 2)
    yield "chance that noise alone resembles any cause as much", chance
    if finding.bic_gain is not None and finding.held_out_gain is not None:
        yield "information it brings (BIC)", fixed(finding.bic_gain, 1)
        yield "saved on samples held out (variances)", fixed(finding.held_out_gain, 1)


def _when(finding: FindingRecord) -> str:
    if finding.from_s is None:
        return ""
    until = "" if finding.to_s is None else f" to {fixed(finding.to_s, 3)}"
    return f", {fixed(finding.from_s, 3)}{until} s on its clock"


def _rivals(finding: FindingRecord, file: DiagnosisFile) -> Iterator[Html]:
    if not finding.rivals:
        if finding.stream is None:
            yield tag("p", "No other cause of the catalogue comes near: within 6 BIC there is none.")
        return
    rows = [(_rival_words(r), fixed(r.margin + 0.0, 1), f"{r.confidence:.3f}") for r in finding.rivals]
    caption = "What it could be instead, everything else refitted"
    yield table(("Alternative", "BIC behind", "confidence"), rows, numeric=(1, 2), caption=caption)
    advice = [line for line in file.next if finding.where in line and finding.physics in line]
    if advice:
        yield tag("p", tag("b", "What to do: "), "; ".join(advice), ".")


def _rival_words(rival: RivalRecord) -> str:
    return place_words(rival) + ("" if rival.plausible else ": only with a size that no machine has")
