"""A number that is to be seen first."""

from calibrate.report.elements import Html, tag


def tile(name: str, value: str, says: str) -> Html:
    """Name, number, and one line about it."""
    return tag("div", tag("span", name, cls="name"), tag("b", value), tag("span", says), cls="tile")
