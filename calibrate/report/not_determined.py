"""Why a parameter was not determined, in plain words, and the figure of the singular values with their gap."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from calibrate.identifiability import WEAK, Identifiability, in_words
from calibrate.report.elements import Html
from calibrate.report.quantities import power_of_ten
from calibrate.report.svg import drawn
from calibrate.report.tones import Tone
from calibrate.sensors.catalogue import FRAMES

OWNERS = {
    "device": "where the measuring device stands",
    "tool": "where the target sits on the flange",
    **{frame.prefix: frame.where for frame in FRAMES},
    "placement": "where the fixture stands",
    "laser mount": "how the laser sits on the flange",
    "psd1": "the gains of PSD 1",
    "psd2": "how PSD 2 sits to PSD 1",
}
NUMBERED = {**{f.prefix: f.one for f in FRAMES if f.one}, "placement": "where fixture station"}  # one of them alone


class Together(Protocol):
    """Parameters that can only be determined together: a combination of the analysis, or of a model.json."""

    @property
    def words(self) -> str: ...

    @property
    def members(self) -> tuple[str, ...]: ...

    @property
    def structural(self) -> bool: ...


def plain_reason(name: str, seen: Identifiability, fallback: str | None) -> str:
    """Sentence for a parameter that was not determined; `fallback` where rank is not the reason."""
    return reason_among(name, seen.combinations, fallback)


def reason_among(name: str, combinations: Sequence[Together], fallback: str | None) -> str:
    """The same from the combinations alone."""
    for combination in combinations:
        if name in combination.members:
            return _says(name, combination)
    return fallback or "not determined"


def kind_of(combination: Together) -> str:
    """Why nothing separates its members."""
    if len(combination.members) == 1:
        return "the measurement does not depend on it"
    if combination.structural:
        return "cannot be separated by geometry, whatever the poses"
    return "hardly separated by these poses; others might"


def in_plain_words(words: str) -> str:
    """'link2.offset + device z' -> 'the offset of link 2 and where the measuring device stands (z)'."""
    return " and ".join(_plain(part) for part in words.split(" + "))


def _says(name: str, combination: Together) -> str:
    if len(combination.members) == 1:
        return "the measurement does not depend on it"
    others = combination.words.split(" + ")
    rest = " and ".join(_plain(words) for words in others if words != in_words([name]))
    if combination.structural:
        return f"no data of this kind can separate it from {rest}"
    return f"these poses hardly separate it from {rest}"


def _plain(words: str) -> str:
    """'placement x, y' -> 'where the fixture stands (x, y)'; 'seat2.z' -> 'where cone 2 is (z)'."""
    owner, _, what = words.partition(".")
    kind = owner.rstrip("0123456789")
    number = owner.removeprefix(kind)
    if kind in NUMBERED and number:
        return f"{NUMBERED[kind]} {number} is ({what})"
    for start, said in OWNERS.items():
        if words.startswith(start):
            axes = words.removeprefix(start).strip(" .")
            return f"{said} ({axes})" if axes else said
    return f"the {what} of {kind} {number}" if kind in ("joint", "link") and what else words


Floats = NDArray[np.float64]

DRAWING = 2.0**0.5  # s^2 = data + 1 for a combination of toleranced links: below, the drawing shows more than the data


def spectrum(singular_values: Floats, rank: int, name: str, *, with_drawing: bool = True) -> Html:
    """Singular values in falling order on a log axis; hollow: not seen."""
    says = f"{len(singular_values)} singular values, {rank} of them above the threshold"
    return drawn(name, says, 4.8, 3.6, lambda figure: _paint_spectrum(figure, singular_values, rank, with_drawing))


def _paint_spectrum(figure: Figure, s: Floats, rank: int, with_drawing: bool) -> None:
    axes = figure.add_subplot()
    axes.set_yscale("log")
    number = np.arange(1, len(s) + 1)
    shown = np.maximum(s, np.finfo(float).eps * s[0])  # below is rounding, and zero has no place on a log axis
    drawing = np.zeros(len(s), dtype=bool) if not with_drawing else s < DRAWING
    drawing[rank:] = False
    data = ~drawing
    data[rank:] = False
    for rows, tone, mark, filled, label in (
        (data, Tone.PLACE_1, "o", True, "known from the data"),
        (drawing, Tone.PLACE_5, "s", True, "known from the nominal values"),
        (number > rank, Tone.BEAM, "o", False, "not known"),
    ):
        if rows.any():
            face = tone.value if filled else "none"
            text = f"{label}: {int(rows.sum())}"
            axes.plot(number[rows], shown[rows], mark, ms=5, mfc=face, mec=tone.value, mew=1.4, label=text)
    axes.axhline(WEAK, color=Tone.INK.value, lw=1.1, linestyle=(0, (4, 3)))
    axes.annotate("worse than a guess", (1.0, WEAK), (2, -11), textcoords="offset points", fontsize=10)
    axes.yaxis.set_major_formatter(FuncFormatter(_power))
    axes.set(xlabel="combination of parameters", title="Plausible size over sigma, of each combination")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 0.08))


def _power(value: float, _: int | None) -> str:
    return power_of_ten(round(np.log10(value)))
