"""proof.html: the sums, the confusion matrix, and each case's story: what was hidden, what was said."""

from collections.abc import Sequence
from pathlib import Path

from calibeam.prove.confusion import confusion_figure
from calibeam.prove.free_space_sums import by_instrument
from calibeam.prove.record import CaseScore, ProofFile
from calibeam.prove.story import faults, hidden_briefly, hidden_words, said_words
from calibeam.prove.summary import summary
from calibeam.prove.tally import NONE, Line, ProofFigure, at_once, by, by_effect, by_enr, by_fault, figures, rivals
from calibrate.report.elements import Html, bullets, figure, folded, section, table, tag
from calibrate.report.page import page, write_page
from calibrate.report.quantities import DASH, length

CONTENTS = {
    "short": "In short",
    "sums": "What was found",
    "doubt": "Doubt and proof",
    "confusion": "What is taken for what",
    "others": "Other methods",
    "stories": "Each case",
    "repeat": "To repeat it",
}
HEAD = ("", "n", "located", "named", "among rivals", "others said, a case")


def write_proof_page(path: Path, proof: ProofFile) -> Path:
    """One HTML file at `path`; returns it. DataError where it cannot be written."""
    return write_page(path, proof_html(proof))


def proof_html(proof: ProofFile) -> str:
    """The page as text."""
    cases = proof.cases
    chapters = [
        _short(cases),
        _sums(cases),
        _doubt(cases),
        _confusion(cases),
        _others(cases),
        _stories(cases),
        _repeat(proof),
    ]
    kept = [(anchor, chapter) for anchor, chapter in zip(CONTENTS, chapters, strict=True) if chapter]
    return page(
        "The concealed proof",
        _masthead(proof),
        {anchor: CONTENTS[anchor] for anchor, _ in kept},
        [chapter for _, chapter in kept],
        proof.software,
    )


def _masthead(proof: ProofFile) -> Html:
    grade = "seed of development: no figures for the public" if proof.development else f"seed {proof.seed}"
    return tag(
        "header",
        tag("p", "Concealed physics, blind diagnosis", cls="kicker"),
        tag("h1", f"{len(proof.cases)} sessions, {sum(len(c.defects) for c in proof.cases)} hidden causes"),
        tag("p", f"{grade} · {proof.wall_s / 60:.1f} min · {proof.software}", cls="byline"),
    )


def _short(cases: Sequence[CaseScore]) -> Html:
    lead = "What a reader in a hurry should know; the chapters below hold each figure, and each case."
    return section("short", CONTENTS["short"], lead, bullets(summary(cases)))


def _sums(cases: Sequence[CaseScore]) -> Html:
    lead = (
        "Mechanisms that share no formula with the catalogue bent each world; the diagnosis saw the recording only. "
        "Located: the right place in the chain. Named: place and physics, first choice. Brackets: 95 % by Wilson."
    )
    several = [at_once(cases, "three"), at_once(cases, "eighteen")]
    return section(
        "sums",
        CONTENTS["sums"],
        lead,
        *_lines("One effect, by its size over the noise after geometry", by_enr(cases)),
        *_lines("By instrument, effects of 0.6 times the noise and more", by(cases, lambda c: c.family)),
        *_lines("The same, by the way that the recording came", by(cases, lambda c: c.path)),
        *_lines("Several at once", several),
        *_lines("Faults of motion, stamps and second encoders, found in streams", by_fault(cases)),
        *_lines("By mechanism, effects of 0.6 times the noise and more", by_effect(cases)),
    )


def _doubt(cases: Sequence[CaseScore]) -> Html:
    lead = "What is said where nothing is to be said, how sizes and errors hold against the truth."
    said = _figures(("", "measured", "wanted"), [f for f in figures(cases) if f.said != NONE])
    return section("doubt", CONTENTS["doubt"], lead, said, *_free_space(cases))


def _free_space(cases: Sequence[CaseScore]) -> list[Html]:
    found = [
        (f.label, str(f.cases), length(f.geometry_m), length(f.found_m), length(f.oracle_m))
        for f in by_instrument(cases)
    ]
    head = ("", "cases", "geometry", "with what was found", "oracle")
    caption = "Free space against the truth: medians of the cases that were compared with the oracle"
    return [table(head, found, numeric=(1, 2, 3, 4), caption=caption)] if found else []


def _confusion(cases: Sequence[CaseScore]) -> Html:
    lead = (
        "Hidden physics in rows, the first thing said in columns; cases with one cause of 0.6 times the noise, or none."
    )
    drawing = figure(confusion_figure(cases), "On the diagonal: right. Beside it: taken for another cause.")
    return section("confusion", CONTENTS["confusion"], lead, drawing)


def _others(cases: Sequence[CaseScore]) -> Html | None:
    others = rivals(cases)
    if not others:
        return None
    lead = (
        "The same unseen samples, the same recordings. 1: all that an oracle removes, which is told the true terms and "
        "has only their sizes to find; 0: no better than geometry alone."
    )
    said = [
        (c.name, hidden_words(c), b.method, DASH if b.gain is None else f"{b.gain:.2f}", b.says)
        for c in cases
        for b in c.baselines
    ]
    answers = table(("case", "hidden", "method", "share", "where and why, in its own words"), said, numeric=(3,))
    return section(
        "others",
        CONTENTS["others"],
        lead,
        _figures(("", "median, p10"), others),
        folded("What each of them says of each case", answers),
    )


def _stories(cases: Sequence[CaseScore]) -> Html:
    lead = "Everything that was hidden and everything that was said. Faults of the diagnosis first."
    wrong = [c for c in cases if faults(c)]
    right = [c for c in cases if not faults(c)]
    return section("stories", CONTENTS["stories"], lead, *map(_story, wrong), *map(_story, right))


def _story(case: CaseScore) -> Html:
    wrong = faults(case)
    way = "" if case.path == "in process" else f" {case.path}"
    title = f"{case.name} · {hidden_briefly(case)} · {'; '.join(wrong) or 'as it should be'}"
    lines = [
        f"{case.kind}, {case.family}{way}, {case.samples} samples.",
        f"Hidden: {hidden_words(case)}.",
        f"Said: {said_words(case)}.",
    ]
    lines += [s.says for s in case.said]
    lines.append(
        f"Unseen samples: {_m(case.held_out_before_m)} with geometry alone, {_m(case.held_out_after_m)} with what was "
        f"found; noise {_m(case.floor_m)}; oracle {_m(case.oracle_m)}."
    )
    lines.append(
        f"Free space, against the truth: {_m(case.free_space_before_m)} before, {_m(case.free_space_after_m)} after; "
        f"oracle {_m(case.oracle_free_space_m)}."
    )
    lines += [
        f"Size of {d.mechanism}: {s.name} {s.true:.3g}, said {s.said:.3g} ± {s.sigma:.2g}."
        for d in case.defects
        for s in d.sizes
    ]
    lines += [f"{d.mechanism}: place taken as right, for {d.equivalent}." for d in case.defects if d.equivalent]
    return folded(title, bullets(lines))


def _repeat(proof: ProofFile) -> Html:
    lead = "Everything is drawn from the seed. The hashes were told before anything was diagnosed."
    return section(
        "repeat",
        CONTENTS["repeat"],
        lead,
        tag("pre", proof.command),
        tag("p", f"SHA-256 of the list of all seals: {proof.published}"),
        tag("p", "Drawn anew because a seed gave no session: " + str(sum(c.attempts for c in proof.cases))),
    )


def _lines(caption: str, lines: Sequence[Line]) -> list[Html]:
    """Nothing where no case was of that kind."""
    rows = [
        (line.label, str(line.located.n), *(share.brief for share in line.shares), line.others)
        for line in lines
        if line.located.n
    ]
    return [table(HEAD, rows, numeric=(1, 5), caption=caption)] if rows else []


def _figures(head: Sequence[str], found: Sequence[ProofFigure]) -> Html:
    return table(head, [(f.label, f.said, f.wanted)[: len(head)] for f in found])


def _m(value: float | None) -> str:
    return DASH if value is None else length(value)
