"""Parameter names put together for a person: what several frames have in common is said once."""

from collections.abc import Sequence

from calibrate.sensors.catalogue import FRAMES

SINGLE = ("device", "tool", *(f.prefix for f in FRAMES if not f.one))
SYMBOLS = {"offset": "d", "length": "a", "twist": "alpha", "tilt": "beta"}  # of a D-H table, Hayati's beta included
NOUNS = {"placement": "fixture", "laser": "laser mount", "device": "base", **{f.prefix: f.noun for f in FRAMES}}
NUMBERED = ("placement", *(f.prefix for f in FRAMES if f.one))  # the number does not matter to the reason


def in_words(names: Sequence[str]) -> str:
    """Names joined; what several placements or seats, a device, a tool or the laser mount share is said once.

    >>> in_words(["joint1.zero", "placement1.x", "placement1.yaw", "placement2.x", "placement2.yaw"])
    'joint1.zero + placement x, yaw'
    """
    groups: dict[str, list[str]] = {}
    for name in names:
        owner, _, what = name.partition(".")
        kind = owner.rstrip("0123456789")
        if kind in NUMBERED:
            owner = kind
        elif owner == "laser":
            owner = "laser mount"
        elif owner not in SINGLE:
            owner, what = name, ""
        listed = groups.setdefault(owner, [])
        if what and what not in listed:
            listed.append(what)
    return " + ".join(f"{owner} {', '.join(what)}" if what else owner for owner, what in groups.items())


def plainly(names: Sequence[str]) -> str:
    """The same in the words of who calibrates: D-H letters add up, the first of unlike things goes with the others.

    >>> plainly(["link2.offset", "link3.offset"]), plainly(["joint1.zero", "device.yaw"])
    ('d2 + d3', 'joint 1 zero with base yaw')
    """
    groups: dict[str, list[str]] = {}
    for name in names:
        owner, what = _owner_and_what(name)
        listed = groups.setdefault(owner, [])
        if what and what not in listed:
            listed.append(what)
    said = [f"{owner} {', '.join(what)}" if what else owner for owner, what in groups.items()]
    if all(_is_letter(name) for name in names) or len(said) == 1:
        return " + ".join(said)
    return f"{said[0]} with {' and '.join(said[1:])}"


def _is_letter(name: str) -> bool:
    owner, _, what = name.partition(".")
    return owner.startswith("link") and what in SYMBOLS


def _owner_and_what(name: str) -> tuple[str, str]:
    """'link2.offset' -> 'd2', ''; 'placement3.yaw' -> 'fixture', 'yaw'; 'joint1.zero' -> 'joint 1 zero', ''."""
    owner, _, what = name.partition(".")
    kind = owner.rstrip("0123456789")
    number = owner.removeprefix(kind)
    if _is_letter(name):
        return f"{SYMBOLS[what]}{number}", ""
    if kind in NOUNS:
        return NOUNS[kind], what
    if kind == "joint":
        return f"joint {number} {what}".strip(), ""
    return f"{kind} {number}".strip(), what
