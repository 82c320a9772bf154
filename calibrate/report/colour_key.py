"""Which colour is which fixture place, as one line of the page."""

from collections.abc import Sequence

from calibrate.report.elements import Html, tag
from calibrate.report.quantities import TIED
from calibrate.report.tones import fill_of, tone_of

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
    """'place 3', on one line."""
    return f"place{TIED}{place}"


def colour_key(places: Sequence[int]) -> Html:
    """All placements with their colours."""
    return tag("p", *(patch(i, place_name(place)) for i, place in enumerate(places)), cls="keys")
