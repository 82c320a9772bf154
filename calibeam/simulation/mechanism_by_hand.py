"""A mechanism in one line, for `calibeam emulate --hide`: "soft-joint joint2 8e-6"."""

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any, cast

from simulators.defects import GIVEN, MECHANISMS, Defect, WrittenError, defects_of

PLACES = ("joint", "link", "psd", "place", "cone")  # fields that a place such as "joint2" or "psd1" fills
USUAL: Mapping[str, Any] = {
    "bearing_rad": 0.0,
    "towards_rad": 0.0,
    "along": (1.0, 0.0, 0.0),
    "about": (0.0, 0.0, 1.0),
    "axis": (0.0, 0.0, 1.0),
    "turn_rad_m": 0.0,
    "second": 0.0,
    "x_share": 1.0,
    "at_laser": True,
    "hardening": 0.5,
    "cycles": 2,
    "at_s": 0.0,
    "until_s": 1e9,
    "centre_m": (0.0, 0.0),
    "lean_y_rad": 0.0,
}  # of what a line leaves out
HALF_FACE_M = 5e-3
UNITS = (
    ("_nms_rad", "Nm/(rad/s)"),
    ("_nm_rad", "Nm/rad"),
    ("_rad_nm", "rad/Nm"),
    ("_rad_s", "rad/s"),
    ("_kg_m2", "kg m²"),
    ("_kg", "kg"),
    ("_rad_nm3", "rad/Nm³"),
    ("_per_nm2", "1/(Nm²)"),
    ("_per_k", "1/K"),
    ("_per_m", "1/m"),
    ("_rad_rad", "rad/rad"),
    ("_rad_m", "rad/m"),
    ("_rad_k", "rad/K"),
    ("_rad", "rad"),
    ("_nm", "Nm"),
    ("_m", "m"),
    ("_v", "V"),
    ("_s", "s"),
)
WEIGHED = ("curve-", "spring-under", "beam-under", "pedestal-under")  # tables of numbers: from a model only
BY_HAND: tuple[type[Defect], ...] = tuple(
    kind
    for kind in (*MECHANISMS, *GIVEN)
    if "dual-psd" in kind.INSTRUMENTS and not kind.KIND.startswith(WEIGHED) and kind.KIND != "outside-fan"
)


def by_hand(text: str, rig: Mapping[str, Any]) -> Defect:
    """The mechanism of one line, with what the rig file knows. WrittenError with the list of all for a wrong name."""
    name, *words = text.split() or [""]
    kind = next((kind for kind in BY_HAND if name == kind.KIND), None)
    if kind is None:
        raise WrittenError(f"--hide {name!r}: no mechanism of this name; take one of the list\n{listing()}")
    given = _given(kind, words)
    known = {field.name for field in _fields(kind)}
    wrong = sorted(given.keys() - known)
    if wrong:
        raise WrittenError(f"--hide {name}: nothing called {', '.join(wrong)}; it takes {form(kind)}")
    usual = {**USUAL, **_of_rig(rig, given)}
    needed = [field.name for field in _fields(kind) if field.default is MISSING and field.name not in given]
    missing = [key for key in needed if key not in usual]
    if missing:
        raise WrittenError(f"--hide {name}: {', '.join(missing)} missing; it takes {form(kind)}")
    made = defects_of([{"mechanism": name, "fields": {key: usual[key] for key in needed} | given}])[0]
    _refuse_place(name, vars(made), rig)
    return made


def form(kind: type[Defect]) -> str:
    """How a line of this mechanism is written: "soft-joint jointN SIZE (compliance_rad_nm, rad/Nm)"."""
    places = [f"{field.name}N" for field in _fields(kind) if field.name in PLACES]
    further = [
        f"{field.name}=… ({unit_of(field.name)})"
        for field in _fields(kind)
        if field.default is MISSING and field.name not in (*PLACES, *USUAL, kind.SIZE, "joints", "half_size_m")
    ]
    return " ".join([kind.KIND, *places, f"SIZE ({kind.SIZE}, {unit_of(kind.SIZE)})", *further])


def listing() -> str:
    """All of them, a line each."""
    return "\n".join(f"  {form(kind)}" for kind in BY_HAND)


def unit_of(field: str) -> str:
    """By the end of its name."""
    return next((unit for ending, unit in UNITS if field.endswith(ending)), "no unit")


def _given(kind: type[Defect], words: Sequence[str]) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for word in words:
        key, separator, value = word.partition("=")
        place = word.rstrip("0123456789")
        if separator:
            out[key] = _values(value)
        elif place in PLACES and place != word:
            out[place] = int(word[len(place) :])
        else:
            out[kind.SIZE] = _number(kind, word)
    return out


def _of_rig(rig: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    joints: Sequence[Mapping[str, Any]] = rig.get("arm", {}).get("joint", ())
    half_m = rig.get("fixture", {}).get("half_size_m", HALF_FACE_M)
    out: dict[str, Any] = {"joints": len(joints), "half_size_m": half_m}
    joint = given.get("joint", 0)
    if 1 <= joint <= len(joints) and "gear_ratio" in joints[joint - 1]:
        out["ratio"] = float(joints[joint - 1]["gear_ratio"])
    return out


def _refuse_place(name: str, of: Mapping[str, Any], rig: Mapping[str, Any]) -> None:
    """WrittenError for a joint, link, detector or place that the rig has not."""
    joints = len(rig.get("arm", {}).get("joint", ()))
    places = [place["id"] for place in rig.get("placement", ())]
    for key, there in (
        ("joint", range(1, joints + 1)),
        ("link", range(1, joints + 1)),
        ("psd", (1, 2)),
        ("place", places),
    ):
        if key in of and of[key] not in there:
            known = ", ".join(map(str, there))
            raise WrittenError(f"--hide {name}: {key}{of[key]} is none of this rig; it has {key} {known}")


def _fields(kind: type[Defect]) -> tuple[Any, ...]:
    return fields(cast("Any", kind))


def _number(kind: type[Defect], word: str) -> float:
    try:
        return float(word)
    except ValueError as error:
        raise WrittenError(f"--hide {kind.KIND}: {word!r} is no size and no place; it takes {form(kind)}") from error


def _values(text: str) -> Any:
    """A number, several joined by commas, a word, or true and false."""
    parts: list[Any] = []
    for part in text.split(","):
        try:
            parts.append(int(part) if part.lstrip("+-").isdigit() else float(part))
        except ValueError:
            parts.append({"true": True, "false": False}.get(part, part))
    return parts[0] if len(parts) == 1 else tuple(parts)
