"""errors.html: an error simulation as one page."""

from pathlib import Path

import numpy as np

from calibrate.error_simulation.sensitivity import ROUNDING_M
from calibrate.error_simulation.simulate import SHARE, Simulation
from calibrate.report.elements import Html, figure, page, section, table, tag, tile, write_page
from calibrate.report.error_simulation_page import PICTURES, Picture
from calibrate.report.quantities import angle, length, significant
from calibrate.report.svg import drawn

CONTENTS = {"budget": "Budget", "each": "Each error alone", "linear": "Linear and drawn", "ranking": "Ranking",
            "worst": "Worst postures"}  # fmt: skip


def write_page_of(path: Path, simulation: Simulation, software: str) -> Path:
    """One HTML file. DataError where it cannot be written."""
    s = simulation
    said = (f"{len(s.sources)} errors", f"{s.drawn.arms:,} arms at each of {len(s.drawn_at_rad)} poses", software)
    masthead = tag(
        "header",
        tag("p", "Error simulation of an arm", cls="kicker"),
        tag("h1", s.machine.name),
        tag("p", " · ".join(said), cls="byline"),
        _tiles(s),
    )
    chapters = (_budget(s), _each(s), _linear(s), _ranking(s), _worst(s))
    return write_page(path, page(f"Errors of {s.machine.name}", masthead, CONTENTS, chapters, software))


def _tiles(s: Simulation) -> Html:
    rms = float(np.sqrt(np.mean(s.wide.rms_m**2)))
    moved = s.linear.rms_m > ROUNDING_M
    apart = float(np.max(np.abs(s.drawn.rms_m[moved] / s.linear.rms_m[moved] - 1.0), initial=0.0))
    return tag(
        "div",
        tile("Probe error", length(rms), "rms over the workspace, three axes together"),
        tile("Worst posture", length(s.worst[0].rms_m if s.worst else 0.0), "rms, by linear propagation"),
        tile("Largest source", s.sources[s.ranking[0]].name, f"{100.0 * s.shares.total[s.ranking[0]]:.1f} % in total"),
        tile("Linear against drawn", f"{100.0 * apart:.2f} %", "largest difference of an rms"),
        cls="tiles",
    )


def _picture(name: str, s: Simulation) -> Html:
    one: Picture = next(p for p in PICTURES if p.name == name)
    drawing = drawn(f"errors-{name}", one.says, one.width_in, one.height_in, one.painter(s))
    return figure(drawing, one.caption)


def _budget(s: Simulation) -> Html:
    return section("budget", "Budget", "Which group of errors the probe error comes from.", _picture("budget", s))


def _each(s: Simulation) -> Html:
    lead = "One error at a time, all others none; over the whole workspace."
    return section("each", CONTENTS["each"], lead, _picture("alone", s), _picture("gains", s))


def _linear(s: Simulation) -> Html:
    p95 = s.drawn.quantile_m(SHARE)
    rows = [
        (
            str(i + 1),
            ", ".join(f"{np.degrees(q):.0f}°" for q in s.drawn_at_rad[i]),
            length(float(s.linear.rms_m[i])),
            length(float(s.drawn.rms_m[i])),
            length(float(p95[i])),
            length(float(s.drawn.worst_m[i])),
        )
        for i in range(len(s.drawn_at_rad))
    ]
    head = ("pose", "joints", "linear rms", "drawn rms", "95 % below", "worst arm")
    lead = (
        "Linear propagation is immediate and gives the causes; random arms need no linearisation and take any "
        "distribution."
    )
    return section(
        "linear", CONTENTS["linear"], lead, _picture("side-by-side", s), table(head, rows, numeric=range(2, 6))
    )


def _ranking(s: Simulation) -> Html:
    rows = [
        (
            s.sources[i].name,
            f"{s.sources[i].law.name}, {_size(s.sources[i].unit, s.sources[i].law.scale)}",
            length(float(s.wide.alone_m[i])),
            f"{100.0 * s.wide.shares[i]:.2f} %",
            f"{100.0 * s.shares.first[i]:.2f} ± {100.0 * s.shares.first_sigma[i]:.2f} %",
            f"{100.0 * s.shares.total[i]:.2f} ± {100.0 * s.shares.total_sigma[i]:.2f} %",
        )
        for i in s.ranking
    ]
    head = ("error", "law, scale", "alone, rms", "linear", "first order", "total")
    lead = (
        "All errors, the most important first. Where total and first order differ, errors act together. Linear shares "
        f"are over {len(s.wide_rad)} poses of the workspace, Sobol indices over {s.shares.poses} of these."
    )
    listing = table(head, rows, numeric=range(2, 6))
    return section("ranking", CONTENTS["ranking"], lead, _picture("shares", s), listing)


def _size(unit: str, value: float) -> str:
    return length(value) if unit == "m" else angle(value) if unit == "rad" else f"{significant(value)} K"


def _worst(s: Simulation) -> Html:
    rows = [
        (
            length(p.rms_m),
            ", ".join(f"{np.degrees(q):.0f}°" for q in p.q_rad),
            ", ".join(f"{x:.3f}" for x in p.probe_m),
        )
        for p in s.worst
    ]
    if not s.worst:
        return section("worst", CONTENTS["worst"], "None of these errors moves the probe in any posture.")
    lead = "Tops of the error over the joint ranges; postures of the same error are listed once."
    return section("worst", CONTENTS["worst"], lead, table(("rms", "joints", "probe in the base (m)"), rows))
