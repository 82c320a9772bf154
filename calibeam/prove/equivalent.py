"""Places that no measurement of these instruments can tell apart: each rule with its reason. Everything else is wrong.

Short on purpose: where a diagnosis may say "or", it has to say so itself, as a rival.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Rule:
    """Two names of one place."""

    holds: Callable[[str, str, str], bool]  # true port, said port, family
    reason: str
    names: frozenset[str] = frozenset()  # of causes at these places that are as equal as the places


def _all_links(true: str, said: str, family: str) -> bool:
    return true == "link*.length" and re.fullmatch(r"link(\d+|\*)\.length", said) is not None


def _one_stand(true: str, said: str, family: str) -> bool:
    return {true, said} == {"base.pose", "device.pose"} and family in ("tracker", "wire")


RULES = (
    Rule(_all_links, "all links grow together: whichever is named, the growth of the arm is meant"),
    Rule(
        _one_stand,
        "one device watches the arm: the base moved one way or the device the other way is the same to every reading",
        frozenset({"base-moved", "device-drift"}),
    ),
)


def same_place(true: str, said: str, family: str) -> str | None:
    """Why the said port is the true one: "" the same word, else the reason of the rule; None: it is another."""
    if true == said:
        return ""
    return next((rule.reason for rule in RULES if rule.holds(true, said, family)), None)


def same_name(true: str, said: str, why: str) -> bool:
    """Whether two names are those of one cause, to every reading; `why` as told by `same_place`."""
    return true == said or any(rule.reason == why and {true, said} <= rule.names for rule in RULES)
