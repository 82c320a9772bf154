"""Which colour is which fixture place, as one line of the page."""

from collections.abc import Sequence

from calibrate.report.elements import Html, tag
from calibrate.report.quantities import TIED
from calibrate.report.tones import tone_of


def patch(number: int, name: str) -> Html:
    """The colour of the n-th placement, from 0, in front of a name."""
    return tag("span", tag("span", "", cls="key", style=f"background: {tone_of(number).css}"), name, cls="place")


def place_name(place: int) -> str:
    """'place 3', on one line."""
    return f"place{TIED}{place}"


def colour_key(places: Sequence[int]) -> Html:
    """All placements with their colours."""
    return tag("p", *(patch(i, place_name(place)) for i, place in enumerate(places)), cls="keys")
