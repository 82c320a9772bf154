"""Colours of the figures: matplotlib draws in stand-ins, the page puts in its own, so that light and dark both read.

The six colours of the placements are those of Okabe and Ito (Color Universal Design, 2008), which colour-blind readers
distinguish; on dark paper lighter ones of the same hues replace them (report.css). The key of placements is one line of
the page.
"""

from collections.abc import Sequence
from enum import Enum
from typing import Literal

from calibrate.quantities import TIED
from calibrate.report.elements.html import Html, tag

Fill = Literal["none", "full", "left", "right", "bottom", "top"]


class Tone(Enum):
    """What is drawn; the value is the stand-in, which no figure uses for anything else."""

    INK = "#010203"
    SOFT = "#020304"
    FAINT = "#030405"
    PAPER = "#040506"
    BEAM = "#050607"
    PLACE_1 = "#060708"
    PLACE_2 = "#070809"
    PLACE_3 = "#08090a"
    PLACE_4 = "#090a0b"
    PLACE_5 = "#0a0b0c"
    PLACE_6 = "#0b0c0d"

    @property
    def css(self) -> str:
        """The page's variable for it."""
        return f"var(--{self.name.lower().replace('_', '-')})"


FILLS: tuple[Fill, ...] = ("none", "full", "left", "right", "bottom", "top")  # of marks, beside the colours
PLACES = (Tone.PLACE_1, Tone.PLACE_2, Tone.PLACE_3, Tone.PLACE_4, Tone.PLACE_5, Tone.PLACE_6)


def place_mark(number: int) -> dict[str, str]:
    """Colour and fill of the marks of the n-th placement, from 0, as matplotlib's plot takes them."""
    tone, fill = tone_of(number).value, fill_of(number)
    return {"mec": tone, "mfc": "none" if fill == "none" else tone, "mfcalt": Tone.PAPER.value, "fillstyle": fill}


def fill_of(number: int) -> Fill:
    """How the marks of the n-th placement are filled, from 0; they come round again with the colours."""
    return FILLS[number % len(FILLS)]


def tone_of(number: int) -> Tone:
    """The colour of the n-th placement, from 0; they come round again after six."""
    return PLACES[number % len(PLACES)]


OPPOSITE = {"left": "right", "right": "left", "bottom": "top", "top": "bottom"}


def patch(number: int, name: str) -> Html:
    """Colour and fill of the marks of the n-th placement, from 0, in front of a name."""
    colour, fill = tone_of(number).css, fill_of(number)
    paint = {"none": "none", "full": colour}.get(
        fill, f"linear-gradient(to {OPPOSITE.get(fill, fill)}, {colour} 50%, transparent 50%)"
    )
    key = tag("span", "", cls="key", style=f"background: {paint}; border-color: {colour}")
    return tag("span", key, name, cls="place")


def place_name(place: int) -> str:
    """'station 3', on one line."""
    return f"station{TIED}{place}"


def colour_key(places: Sequence[int]) -> Html:
    """All placements with their colours."""
    return tag("p", *(patch(i, place_name(place)) for i, place in enumerate(places)), cls="keys")
