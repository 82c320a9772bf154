"""The confusion matrix: what was hidden against what was said first, one row a kind of physics."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from calibeam.prove.record import UNKNOWN, CaseScore
from calibrate.report.elements import Html
from calibrate.report.svg import drawn
from calibrate.report.tones import Tone

PLAIN_ENR = 0.6  # effect over noise
SINGLE = ("one", "disturbed", "outside", "streams")
NOTHING = "nothing"
FAILED = "failed"
ELSEWHERE = "right name, elsewhere"
LAST = (UNKNOWN, NOTHING, ELSEWHERE, FAILED)
CELL_IN = 0.27
MARGIN_IN = 2.2


def confusion(cases: Sequence[CaseScore]) -> tuple[list[str], list[str], NDArray[np.int64]]:
    """Words hidden, words said, counts. Of cases with none or one cause; several at once have no single answer."""
    pairs: Counter[tuple[str, str]] = Counter()
    for case in cases:
        if case.kind in SINGLE and case.defects and case.defects[0].enr >= PLAIN_ENR:
            pairs[case.defects[0].physics, _said(case)] += 1
        elif not case.defects:
            pairs[NOTHING, _said(case)] += 1
    hidden = _ordered({h for h, _ in pairs})
    said = _ordered({s for _, s in pairs} | set(hidden))
    counts = np.array([[pairs[h, s] for s in said] for h in hidden], dtype=np.int64).reshape(len(hidden), len(said))
    return hidden, said, counts


def _said(case: CaseScore) -> str:
    """The right word where it was said at the right place, else the largest finding's."""
    if any(d.named for d in case.defects):
        return case.defects[0].physics
    if case.error:
        return FAILED
    if not case.said:
        return UNKNOWN if case.unexplained else NOTHING
    first = case.said[0].physics
    return ELSEWHERE if case.defects and first == case.defects[0].physics else first


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

    says = f"Hidden against said physics: {right} of {int(counts.sum())} on the diagonal."
    width, height = MARGIN_IN + CELL_IN * len(said), MARGIN_IN + CELL_IN * len(hidden)
    return drawn("confusion", says, width, height, paint)


def _cell(x: int, y: int, tone: Tone, share: float) -> Rectangle:
    return Rectangle((x - 0.5, y - 0.5), 1.0, 1.0, color=tone.value, alpha=share, linewidth=0.0)
