"""Why something was not determined, in the words of who stands beside the robot."""

from calibrate.identifiability import Combination, Identifiability, in_words

OWNERS = {
    "placement": "where the fixture stands",
    "laser mount": "how the laser sits on the flange",
    "psd1": "the gains of PSD 1",
    "psd2": "how PSD 2 sits to PSD 1",
}


def plain_reason(name: str, seen: Identifiability, fallback: str | None) -> str:
    """Sentence for a parameter that was not determined; `fallback` where rank is not the reason."""
    for combination in seen.combinations:
        if name in combination.members:
            return _says(name, combination)
    return fallback or "not determined"


def _says(name: str, combination: Combination) -> str:
    if len(combination.members) == 1:
        return "the measurement does not depend on it"
    others = combination.words.split(" + ")
    rest = " and ".join(_plain(words) for words in others if words != in_words([name]))
    if combination.structural:
        return f"no data of this kind can tell it from {rest}"
    return f"these poses hardly tell it from {rest}"


def _plain(words: str) -> str:
    """'placement x, y, yaw' -> 'where the fixture stands (x, y, yaw)'; 'joint6.zero' -> 'the zero of joint 6'."""
    for owner, said in OWNERS.items():
        if words.startswith(owner):
            axes = words.removeprefix(owner).strip(" .")
            return f"{said} ({axes})" if axes else said
    owner, _, what = words.partition(".")
    for kind in ("joint", "link"):
        if owner.startswith(kind) and what:
            return f"the {what} of {kind} {owner.removeprefix(kind)}"
    return words
