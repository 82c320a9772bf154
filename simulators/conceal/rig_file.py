"""The rig file of a concealed session: assumed values, never true ones; and nested values as TOML text.

TOML: tables, arrays of tables, and inline tables for what has no table below it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simulators.arm.drawing import Drawing, origin_and_rotation
from simulators.conceal.rig import ENCODER_RAD, Artefacts, Device, DualPsd, TrueRig
from simulators.conceal.rigs import DrawnRig
from simulators.conceal.wanted import Wanted


def toml_text(document: Mapping[str, Any]) -> str:
    """A document whose values are numbers, words, lists, mappings or lists of mappings."""
    lines: list[str] = []
    _write(document, "", lines)
    return "\n".join(lines).strip() + "\n"


def _write(table: Mapping[str, Any], path: str, lines: list[str]) -> None:
    for key, value in table.items():
        if not _is_table(value) and not _is_tables(value):
            lines.append(f"{key} = {_value(value)}")
    for key, value in table.items():
        name = f"{path}{key}"
        if _is_table(value):
            lines += ["", f"[{name}]"]
            _write(value, f"{name}.", lines)
        elif _is_tables(value):
            for entry in value:
                lines += ["", f"[[{name}]]"]
                _write(entry, f"{name}.", lines)


class Inline(dict[str, Any]):
    """A mapping that stands on one line."""


def _is_table(value: object) -> bool:
    return isinstance(value, Mapping) and not isinstance(value, Inline)


def _is_tables(value: object) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str) and bool(value) and _is_table(value[0])


def _value(value: Any) -> str:
    if isinstance(value, Inline):
        return "{ " + ", ".join(f"{key} = {_value(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, Sequence):
        return "[" + ", ".join(_value(inner) for inner in value) + "]"
    return repr(float(value))


Floats = NDArray[np.float64]


@dataclass(frozen=True)
class KnownDistance:
    """A length between the PSD 1 centres of two places, as it was measured."""

    first: int
    second: int
    length_m: float
    sigma_m: float


@dataclass(frozen=True, eq=False)
class StatedRig:
    """All that goes into rig.toml."""

    drawing: Drawing
    rig: TrueRig  # as assumed
    tool_kg: float | None
    tool_com_m: Floats
    device_known: bool
    distances: Sequence[KnownDistance]
    bars_m: Sequence[float]
    noise: Mapping[str, float]
    tolerance: Mapping[str, float]  # empty: the file has none
    encoder_side: str = ""  # of all second encoders, as the file states; empty: it does not
    targets_m: Floats | None = None  # (target, 3) of several, as assumed
    targets_sigma_m: float | None = None  # as stated of each


def rig_document(stated: StatedRig) -> dict[str, Any]:
    """The rig file as nested values, in the order of the interchange format."""
    document: dict[str, Any] = {"schema": 1, "name": stated.drawing.name}
    document["arm"] = _arm(stated)
    if stated.encoder_side:
        for joint in document["arm"]["joint"]:
            joint["encoder_side"] = stated.encoder_side
    document["tool"] = _tool(stated)
    if stated.targets_m is not None:
        known = {} if stated.targets_sigma_m is None else {"point_sigma_m": stated.targets_sigma_m}
        points = enumerate(stated.targets_m.tolist(), start=1)
        document["target"] = [{"id": k, "point_m": point} | known for k, point in points]
    instrument = stated.rig.instrument
    if isinstance(instrument, DualPsd):
        document["fixture"] = {
            "half_size_m": instrument.half_size_m,
            "psd2_in_psd1": Inline(pose_record(instrument.psd2_in_psd1)),
        }
        document["placement"] = [
            {"id": number, "psd1_in_base": Inline(pose_record(place))}
            for number, place in enumerate(instrument.places, start=1)
        ]
    if isinstance(instrument, Device) and stated.device_known:
        document["device"] = pose_record(instrument.pose)
    if stated.distances:
        document["known_distance"] = [
            {"from": one.first, "to": one.second, "length_m": one.length_m, "sigma_m": one.sigma_m}
            for one in stated.distances
        ]
    if stated.bars_m:
        document["bar"] = [{"id": number, "length_m": length} for number, length in enumerate(stated.bars_m, start=1)]
    document["noise"] = dict(stated.noise)
    if stated.tolerance:
        document["tolerance"] = dict(stated.tolerance)
    return document


def _arm(stated: StatedRig) -> dict[str, Any]:
    drawing = stated.drawing
    flange = dict(zip(("origin_m", "rotation_rad"), map(list, drawing.flange), strict=True))
    return {
        "model": drawing.model,
        "gravity_m_s2": stated.rig.arm.gravity_m_s2.tolist(),
        "joint": [_joint(drawing, index) for index in range(drawing.n_joints)],
        "flange": flange,
    }


def _joint(drawing: Drawing, index: int) -> dict[str, Any]:
    if drawing.model == "local-poe":
        origin_m, rotation_rad = drawing.fixed[index]
        joint: dict[str, Any] = {"origin_m": list(origin_m), "rotation_rad": list(rotation_rad)}
    else:
        row = drawing.rows[index]
        joint = {
            "a_m": row.a_m,
            "alpha_rad": row.alpha_rad,
            "d_m": row.d_m,
            "theta_offset_rad": row.theta_offset_rad,
        }
    joint |= {"lower_rad": drawing.lower_rad[index], "upper_rad": drawing.upper_rad[index]}
    if drawing.gear_ratio:
        joint["gear_ratio"] = drawing.gear_ratio[index]
    if drawing.mass_kg:
        joint |= {"mass_kg": drawing.mass_kg[index], "com_m": list(drawing.com_m[index])}
    return joint


def _tool(stated: StatedRig) -> dict[str, Any]:
    tool: dict[str, Any] = {}
    if stated.tool_kg is not None:
        tool |= {"mass_kg": stated.tool_kg, "com_m": stated.tool_com_m.tolist()}
    instrument = stated.rig.instrument
    if isinstance(instrument, DualPsd):
        return tool | {
            "laser_origin_m": instrument.laser_origin_m.tolist(),
            "laser_direction": instrument.laser_direction.tolist(),
        }
    return tool if stated.targets_m is not None else tool | {"point_m": stated.rig.tool_point_m.tolist()}


def pose_record(pose: Floats) -> dict[str, Any]:
    origin_m, rotation_rad = origin_and_rotation(pose)
    return {"origin_m": list(origin_m), "rotation_rad": list(rotation_rad)}


NOISE_KEY = {"dual-psd": "psd_m", "tracker": "position_m", "wire": "wire_m", "cones": "seat_m"}
WRONG_BY = (1.5, 8.0)  # the noise of a rig file against the true one, up or down


def state_rig(
    wanted: Wanted, drawn: DrawnRig, distances: Sequence[KnownDistance], sigma_m: float, rng: np.random.Generator
) -> StatedRig:
    """The rig file of a session whose true noise is `sigma_m`."""
    wrong = float(np.exp(rng.choice([-1.0, 1.0]) * rng.uniform(*np.log(WRONG_BY))))
    spread = drawn.spread
    tolerance = {"length_m": spread.length_m, "angle_rad": spread.angle_rad}
    if wanted.family == "dual-psd":
        tolerance |= {"psd2_m": spread.psd2_m, "psd2_rad": spread.psd2_rad}
    noise = {NOISE_KEY[wanted.family]: sigma_m * wrong}
    if wanted.family == "cones":
        noise["joint_rad"] = ENCODER_RAD * wrong
    bars_m = drawn.true.instrument.bar_m if isinstance(drawn.true.instrument, Artefacts) else np.empty(0)
    weighed = drawn.nominal.arm.tool_kg > 0.0 and bool(drawn.drawing.mass_kg)
    return StatedRig(
        drawing=drawn.drawing,
        rig=drawn.nominal,
        tool_kg=drawn.nominal.arm.tool_kg if weighed else None,
        tool_com_m=drawn.nominal.arm.tool_com_m,
        device_known=bool(rng.random() < 0.5),
        distances=distances,
        bars_m=tuple(bars_m.tolist()),
        noise=noise,
        tolerance=tolerance if rng.random() < 0.6 else {},
        encoder_side="" if not wanted.side_stated else "link" if wanted.encoders == "link" else "motor",
    )
