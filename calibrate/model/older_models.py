"""Keys of model.json that have other names now, given their present ones; what is wrong in them is found afterwards.

Until November 2026 `rms_before_m` and `rms_after_m` were rms lengths of error vectors, but for models of spots alone
rms of single coordinates; those also named their noise differently.
"""

from math import sqrt
from typing import Any, cast

SPOTS = "dual-psd"
# Coordinates that make up the length of an error: of a pose those of its position.
COORDINATES = {SPOTS: 4, "point": 2, "position": 3, "full-pose": 3, "distance": 1, "wire": 1, "seat": 3, "bar": 1}
STATES = ("before", "after")
OF_SPOTS_ALONE = "joint_believed_rad"  # a key of the noise that only such models had
NOISE = {"joint_believed_rad": "joint_believed", "joint_rad": "joint", "joint_sigma_rad": "joint_sigma"} | {
    "psd_believed_m": "psd_believed",
    "psd_m": "psd",
    "psd_sigma_m": "psd_sigma",
    "converged": "settled",
}

Fields = dict[str, Any]


def with_present_names(content: Fields) -> Fields:
    """The top level of a model.json; one that has the present names as it is."""
    if not any(f"rms_{state}_m" in content for state in STATES):
        return content
    out = dict(content)
    noise, instruments = out.get("noise"), out.get("instruments", [SPOTS])
    alone = isinstance(noise, dict) and OF_SPOTS_ALONE in noise
    first = cast("list[Any]", instruments)[0] if isinstance(instruments, list) and instruments else None
    size = sqrt(COORDINATES.get(str(first), 1))
    for state in STATES:
        if f"rms_{state}_m" in out:
            value = out.pop(f"rms_{state}_m")
            coordinate, distance = (1.0, size) if alone else (1.0 / size, 1.0)
            out[f"rms_coordinate_{state}_m"] = _times(value, coordinate)
            out[f"rms_distance_{state}_m"] = _times(value, distance)
    if alone:
        out["noise"] = {NOISE.get(name, name): value for name, value in cast("Fields", noise).items()}
    out["proofs"] = [_proof(proof) for proof in out["proofs"]] if isinstance(out.get("proofs"), list) else []
    held = out.get("held_out")
    if isinstance(held, dict):
        out["held_out"] = _held_out(cast("Fields", held), size)
    return out


def _proof(proof: object) -> object:
    if not isinstance(proof, dict):
        return proof
    names = {f"rms_{state}": f"rms_distance_{state}_m" for state in STATES}
    return {names.get(key, key): value for key, value in cast("Fields", proof).items()}


def _held_out(held: Fields, size: float) -> Fields:
    out: Fields = {}
    for name, value in held.items():
        state = name.removesuffix("_m").rpartition("_")[2]
        if name == f"rms_{state}_m":  # of spots alone
            out[f"{SPOTS}_rms_distance_{state}_m"] = _times(value, size)
        elif name == "poses":
            out[f"{SPOTS}_observations"] = value
        else:
            out[f"{name.removesuffix(f'_{state}')}_distance_{state}_m" if f"_rms_{state}" in name else name] = value
    return out


def _times(value: object, factor: float) -> object:
    return value * factor if isinstance(value, float | int) and not isinstance(value, bool) else value
