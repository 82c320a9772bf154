"""Why a parameter was not determined, in plain words."""

from collections.abc import Sequence
from typing import Protocol

from calibrate.fit.rank.identifiability import Identifiability, in_words
from calibrate.model.sensors.catalogue import FRAMES

OWNERS = {
    "device": "where the measuring device stands",
    "tool": "where the target sits on the flange",
    **{frame.prefix: frame.where for frame in FRAMES},
    "placement": "where the fixture stands",
    "laser mount": "how the laser sits on the flange",
    "laser": "how the laser sits on the flange",
    "psd1": "the gains of PSD 1",
    "psd2.gain": "the gains of PSD 2",
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
