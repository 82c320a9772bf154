"""When today's answer is the frozen one. All bounds are in units of the frozen one sigma, and stated here alone.

A tenth of a sigma changes no conclusion: added in squares it makes a sigma 0.5 % larger. Rounding of another processor
moves estimates by less than a thousandth of a sigma, another way to the same minimum by less than a hundredth.
"""

import math
from collections.abc import Mapping

from .program import Columns, Json

VALUE_SIGMAS = 0.1
SIGMA_SHARE = 0.02  # of a sigma: beyond the half per cent by which noise that is found again may differ
FLOOR_SHARE = 0.02  # of the noise floor
SAME = 1e-10  # m and rad: predictions of one and the same model; readings are kept to as many digits
NAME = ("where", "depends_on", "shape", "order", "physics")  # of a finding


def parameters(model: Json, prefix: str = "") -> Json:
    """Name -> value and sigma; `None` where the parameter is not determined."""
    return {
        p["name"]: None if p["value"] is None else {"value": p["value"], "sigma": p["sigma"]}
        for p in model["parameters"]
        if p["name"].startswith(prefix)
    }


def findings(diagnosis: Json) -> Json:
    """What is frozen of a diagnosis."""
    lost = diagnosis["unexplained"]
    return {
        "verdict": diagnosis["verdict"],
        "noise_floor_m": diagnosis["noise_floor_m"],
        "unexplained": None if lost is None else lost["where"],
        "findings": [
            {key: finding[key] for key in (*NAME, "parameters")}
            for finding in sorted(diagnosis["findings"], key=lambda finding: [str(finding[key]) for key in NAME])
        ],
    }


def parameter_differences(now: Mapping[str, Json | None], frozen: Mapping[str, Json | None]) -> list[str]:
    """A line for each parameter that is missing, new, no longer or newly determined, elsewhere, or less certain."""
    lines = [f"{name}: only {'now' if name in now else 'frozen'}" for name in sorted(now.keys() ^ frozen.keys())]
    for name in sorted(now.keys() & frozen.keys()):
        one, other = now[name], frozen[name]
        if one is None or other is None:
            if one is not other:
                lines.append(f"{name}: {'not determined' if one is None else one}, frozen {other or 'not determined'}")
            continue
        lines += [f"{name}: {word}" for word in _size_differences(name, one, other)]
    return lines


def _size_differences(name: str, now: Json, frozen: Json) -> list[str]:
    moved = now["value"] - frozen["value"]
    if name == "phase_rad":
        moved = math.remainder(moved, math.tau)
    if name.startswith("combination"):  # of unknown masses: the sign of a singular vector is nobody's
        moved = abs(now["value"]) - abs(frozen["value"])
    sigma = frozen["sigma"]
    lines = []
    if not abs(moved) <= VALUE_SIGMAS * sigma:
        lines.append(f"{now['value']:.6g}, frozen {frozen['value']:.6g}: {moved / sigma:+.2f} sigma")
    if not abs(now["sigma"] - sigma) <= SIGMA_SHARE * sigma:
        lines.append(f"sigma {now['sigma']:.4g}, frozen {sigma:.4g}")
    return lines


def finding_differences(now: Json, frozen: Json) -> list[str]:
    """Of two `findings`: verdict, names, sizes, noise floor, what is left unexplained."""
    words = ("verdict", "unexplained")
    lines = [f"{key}: {now[key]}, frozen {frozen[key]}" for key in words if now[key] != frozen[key]]
    floor, before = now["noise_floor_m"], frozen["noise_floor_m"]
    if not abs(floor - before) <= FLOOR_SHARE * before:
        lines.append(f"noise_floor_m: {floor}, frozen {before}")
    one, other = _named(now), _named(frozen)
    lines += [f"{name}: only {'now' if name in one else 'frozen'}" for name in sorted(one.keys() ^ other.keys())]
    for name in sorted(one.keys() & other.keys()):
        lines += [f"{name}: {line}" for line in parameter_differences(one[name], other[name])]
    return lines


def _named(diagnosis: Json) -> dict[str, Json]:
    """Name of a finding -> its sizes."""
    return {" ".join(str(one[key]) for key in NAME): one["parameters"] for one in diagnosis["findings"]}


def column_differences(now: Columns, frozen: Columns) -> list[str]:
    """Columns that are missing or new, and the first row of each column that differs."""
    lines = [f"{name}: only {'now' if name in now else 'frozen'}" for name in sorted(now.keys() ^ frozen.keys())]
    for name in sorted(now.keys() & frozen.keys()):
        if len(now[name]) != len(frozen[name]):
            lines.append(f"{name}: {len(now[name])} rows, frozen {len(frozen[name])}")
        pairs = zip(now[name], frozen[name], strict=False)
        apart = [(row, a, b) for row, (a, b) in enumerate(pairs, start=1) if not _same(a, b)]
        lines += [f"{name}, row {row}: {a}, frozen {b}" for row, a, b in apart[:1]]
    return lines


def _same(a: float | None, b: float | None) -> bool:
    return a is b if a is None or b is None else abs(a - b) <= SAME
