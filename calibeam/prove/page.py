"""proof.html: five sentences, the sums, the confusion matrix, and each case: what was hidden, what was reported."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from calibeam.prove.record import PLAIN, UNKNOWN, CaseScore, ProofFile
from calibeam.prove.tally import (
    NONE,
    TallyLine,
    at_once,
    by,
    by_effect,
    by_enr,
    by_fault,
    by_motion,
    faults,
    figures,
    plain,
    share,
)
from calibrate.quantities import DASH, length
from calibrate.report.elements.html import (
    Html,
    bullets,
    figure,
    folded,
    page,
    section,
    table,
    tag,
    write_page,
)
from calibrate.report.elements.svg import drawn
from calibrate.report.elements.tones import Tone


def summary(cases: Sequence[CaseScore]) -> list[str]:
    """One sentence for each kind of case that there is."""
    return [s for s in (_single(cases), _nothing(cases), _outside(cases), _faulty(cases)) if s]


def _single(cases: Sequence[CaseScore]) -> str:
    line = plain(cases, "")
    if not line.located.n:
        return ""
    return (
        f"{line.located.n} single causes of {PLAIN:g} times the noise and more: located {line.located.brief}, named "
        f"{line.named.brief}, named or among the alternatives {line.among_rivals.brief}."
    )


def _nothing(cases: Sequence[CaseScore]) -> str:
    null = [c for c in cases if not c.defects]
    if not null:
        return ""
    return f"{len(null)} sessions with nothing wrong: something was reported in {share(c.alarmed for c in null).brief}."


def _outside(cases: Sequence[CaseScore]) -> str:
    strange = [c for c in cases if c.kind == "outside" and all(d.enr >= PLAIN for d in c.defects)]
    if not strange:
        return ""
    found, wrong = share(c.defects[0].located for c in strange), share(c.misnamed for c in strange)
    return (
        f"{len(strange)} mechanisms of no catalogue: located {found.brief}, given a wrong name with confidence "
        f"{wrong.brief}."
    )


def _faulty(cases: Sequence[CaseScore]) -> str:
    wrong = sum(bool(faults(c)) for c in cases)
    return f"{wrong} of {len(cases)} cases have at least one fault of the diagnosis; they come first."


SINGLE = ("one", "disturbed", "outside", "streams", "motion")
NOTHING = "nothing"
FAILED = "failed"
OTHER_PLACE = "right name, elsewhere"
LAST = (UNKNOWN, NOTHING, OTHER_PLACE, FAILED)
CELL_IN = 0.27
MARGIN_IN = 2.2


def confusion(cases: Sequence[CaseScore]) -> tuple[list[str], list[str], NDArray[np.int64]]:
    """Names hidden, names reported, counts. Of cases with none or one cause; several at once have no single answer."""
    pairs: Counter[tuple[str, str]] = Counter()
    for case in cases:
        if case.kind in SINGLE and len(case.defects) == 1 and case.defects[0].enr >= PLAIN:
            pairs[case.defects[0].physics, _said(case)] += 1
        elif not case.defects:
            pairs[NOTHING, _said(case)] += 1
    hidden = _ordered({h for h, _ in pairs})
    said = _ordered({s for _, s in pairs} | set(hidden))
    counts = np.array([[pairs[h, s] for s in said] for h in hidden], dtype=np.int64).reshape(len(hidden), len(said))
    return hidden, said, counts


def _said(case: CaseScore) -> str:
    """The right name where it was reported at the right place, else the largest finding's."""
    if any(d.named for d in case.defects):
        return case.defects[0].physics
    if case.error:
        return FAILED
    if not case.said:
        return UNKNOWN if case.unexplained else NOTHING
    first = case.said[0].physics
    return OTHER_PLACE if case.defects and first == case.defects[0].physics else first


def _ordered(words: set[str]) -> list[str]:
    """By name, those that are none at the end."""
    return sorted(words - {*LAST}) + [w for w in LAST if w in words]


def confusion_figure(cases: Sequence[CaseScore]) -> Html:
    """As a picture: the diagonal is right."""
    hidden, said, counts = confusion(cases)
    right = sum(int(counts[i, said.index(word)]) for i, word in enumerate(hidden))

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        axes.grid(visible=False)
        for i, word in enumerate(hidden):
            for j, other in enumerate(said):
                if counts[i, j]:
                    tone = Tone.PLACE_1 if word == other else Tone.PLACE_2
                    share = 0.2 + 0.5 * counts[i, j] / max(int(counts[i].sum()), 1)
                    axes.add_patch(_cell(j, i, tone, share))
                    axes.text(j, i, str(counts[i, j]), ha="center", va="center", fontsize=8.0)
        axes.set(xlim=(-0.5, len(said) - 0.5), ylim=(len(hidden) - 0.5, -0.5), xlabel="said", ylabel="hidden")
        axes.set_xticks(range(len(said)), said, rotation=90, fontsize=8.0)
        axes.set_yticks(range(len(hidden)), hidden, fontsize=8.0)
        for i in range(1, len(hidden)):  # lines between the cells, to read a far one by
            axes.axhline(i - 0.5, color=Tone.FAINT.value, linewidth=0.6, zorder=0.5)
        for j in range(1, len(said)):
            axes.axvline(j - 0.5, color=Tone.FAINT.value, linewidth=0.6, zorder=0.5)
        axes.tick_params(length=0.0)

    says = f"Hidden against reported physics: {right} of {int(counts.sum())} on the diagonal."
    width, height = MARGIN_IN + CELL_IN * len(said), MARGIN_IN + CELL_IN * len(hidden)
    return drawn("confusion", says, width, height, paint)


def _cell(x: int, y: int, tone: Tone, share: float) -> Rectangle:
    return Rectangle((x - 0.5, y - 0.5), 1.0, 1.0, color=tone.value, alpha=share, linewidth=0.0)


CONTENTS = {
    "short": "In short",
    "sums": "What was found",
    "doubt": "Uncertainty and proof",
    "confusion": "What is taken for what",
    "stories": "Each case",
    "repeat": "To repeat it",
}
HEAD = ("", "n", "located", "named", "or among alternatives", "others reported, a case")


def write_proof_page(path: Path, proof: ProofFile) -> Path:
    """One HTML file at `path`; returns it. DataError where it cannot be written."""
    return write_page(path, proof_html(proof))


def proof_html(proof: ProofFile) -> str:
    """The page as text."""
    cases = proof.cases
    chapters = [
        _short(cases),
        _sums(cases),
        _uncertainty(cases),
        _confusion(cases),
        _stories(cases),
        _repeat(proof),
    ]
    return page("The concealed proof", _masthead(proof), CONTENTS, chapters, proof.software, kind="proof")


def _masthead(proof: ProofFile) -> Html:
    grade = "development seed: not for publication" if proof.development else f"seed {proof.seed}"
    return tag(
        "header",
        tag("p", "Concealed physics, blind diagnosis", cls="kicker"),
        tag("h1", f"Sessions: {len(proof.cases)}, hidden causes: {sum(len(c.defects) for c in proof.cases)}"),
        tag("p", f"{grade} · {proof.wall_s / 60:.1f} min · {proof.software}", cls="byline"),
    )


def _short(cases: Sequence[CaseScore]) -> Html:
    lead = "The main results; the chapters below hold each figure and each case."
    return section("short", CONTENTS["short"], lead, bullets(summary(cases)))


def _sums(cases: Sequence[CaseScore]) -> Html:
    lead = (
        "Each world has mechanisms that share no formula with the catalogue; the diagnosis has the recording only. "
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
        *_lines("Torques of recorded motions", by_motion(cases)),
        *_lines("Faults of motion, stamps and second encoders, found in streams", by_fault(cases)),
        *_lines("By mechanism, effects of 0.6 times the noise and more", by_effect(cases)),
    )


def _uncertainty(cases: Sequence[CaseScore]) -> Html:
    lead = "What is reported where nothing is hidden, and how sizes and errors compare with the truth."
    said = table(("", "measured", "wanted"), [(f.label, f.said, f.wanted) for f in figures(cases) if f.said != NONE])
    return section("doubt", CONTENTS["doubt"], lead, said)


def _confusion(cases: Sequence[CaseScore]) -> Html:
    lead = "Hidden physics in rows, the first finding in columns; cases with one cause of 0.6 times the noise, or none."
    if not confusion(cases)[0]:
        return section("confusion", CONTENTS["confusion"], "No case has one cause, or none.")
    drawing = figure(confusion_figure(cases), "On the diagonal: right. Beside it: taken for another cause.")
    return section("confusion", CONTENTS["confusion"], lead, drawing)


def _stories(cases: Sequence[CaseScore]) -> Html:
    lead = "Everything that was hidden and everything that was reported. Faults of the diagnosis first."
    wrong = [c for c in cases if faults(c)]
    right = [c for c in cases if not faults(c)]
    return section("stories", CONTENTS["stories"], lead, *map(_story, wrong), *map(_story, right))


def hidden_words(case: CaseScore) -> str:
    """All that the seal held."""
    if not case.defects:
        return f"nothing, {case.noise} noise"
    each = [f"{d.mechanism} ({d.physics}) at {d.port}, {d.enr:.2g} x noise" for d in case.defects]
    kept = f"; missing column: {', '.join(case.withheld)}" if case.withheld else ""
    return ", ".join(each) + kept


def hidden_briefly(case: CaseScore) -> str:
    """The same for a heading: what, where, and how large the largest."""
    match case.defects:
        case ():
            return f"nothing, {case.noise} noise"
        case (only,):
            kept = ", its column withheld" if case.withheld else ""
            return f"{only.mechanism} at {only.port}, {only.enr:.2g} x noise{kept}"
        case several:
            return f"{len(several)} causes"


def said_words(case: CaseScore) -> str:
    """Verdict and findings."""
    if not case.said:
        return case.verdict
    each = [f"{s.physics} at {s.where} by {s.depends_on or 'nothing recorded'} ({s.confidence:.2f})" for s in case.said]
    return f"{case.verdict}: " + ", ".join(each)


def _story(case: CaseScore) -> Html:
    wrong = faults(case)
    way = "" if case.path == "in process" else f" {case.path}"
    title = f"{case.name} · {hidden_briefly(case)} · {'; '.join(wrong) or 'as expected'}"
    lines = [
        f"{case.kind}, {case.family}{way}, {case.samples} samples.",
        f"Hidden: {hidden_words(case)}.",
        f"Reported: {said_words(case)}.",
    ]
    lines += [s.says for s in case.said]
    lines += _unseen_torque(case) if case.kind == "motion" else _unseen(case)
    lines += [
        f"Size of {d.mechanism}: {s.name} {s.true:.3g}, reported {s.said:.3g} ± {s.sigma:.2g}."
        for d in case.defects
        for s in d.sizes
    ]
    lines += [f"{d.mechanism}: place taken as right, for {d.equivalent}." for d in case.defects if d.equivalent]
    return folded(title, bullets(lines))


def _unseen_torque(case: CaseScore) -> list[str]:
    left = case.torque_over_noise
    return [] if left is None else [f"Torque left on the unseen end of the motion: {left:.2f} times the noise."]


def _unseen(case: CaseScore) -> list[str]:
    return [
        f"Unseen samples: {_m(case.held_out_before_m)} with geometry alone, {_m(case.held_out_after_m)} with what was "
        f"found; noise {_m(case.floor_m)}.",
        f"Tool error over the workspace, against the truth: {_m(case.free_space_before_m)} before, "
        f"{_m(case.free_space_after_m)} after.",
    ]


def _repeat(proof: ProofFile) -> Html:
    lead = "Everything is drawn from the seed. The hashes were published before anything was diagnosed."
    return section(
        "repeat",
        CONTENTS["repeat"],
        lead,
        tag("pre", proof.command),
        tag("p", f"SHA-256 of the list of all seals: {proof.published}"),
        tag("p", "Drawn again because a seed gave no session: " + str(sum(c.attempts for c in proof.cases))),
    )


def _lines(caption: str, lines: Sequence[TallyLine]) -> list[Html]:
    """Nothing where no case was of that kind."""
    rows = [
        (line.label, str(line.located.n), *(share.brief for share in line.shares), line.others)
        for line in lines
        if line.located.n
    ]
    return [table(HEAD, rows, numeric=(1, 5), caption=caption)] if rows else []


def _m(value: float | None) -> str:
    return DASH if value is None else length(value)
