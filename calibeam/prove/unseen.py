"""Where two models, geometry alone and with the physics that was found, put the tool at poses that nobody measured.

The poses are asked by a file: joint readings and approach, standing, unloaded, all else as at the first sample. A model
that has no answer leaves its part of the answer file out.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.state import Fitted
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Perturbation
from calibrate.model.effects.term import Accepted
from calibrate.model.with_effects.new_poses import carried_over, extended, moves_tool
from calibrate.model.with_effects.ported_chain import perturbed_frames

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

MOVED_RAD = 0.05  # of every joint before it stands, as asked
COPIES = 40  # of the session at a time: some ten thousand poses


@dataclass(frozen=True)
class LaserBeam:
    """Laser lines in the base frame."""

    origin_m: Floats  # (pose, 3)
    direction: Floats  # (pose, 3)


Tool = Floats | LaserBeam  # tip (pose, 3) m in the base frame, or the laser's beam


def tool_at(state: Fitted, q_rad: Floats, approach: Floats) -> Tool | None:
    """By one model. None where one of its terms cannot be evaluated at poses other than those measured."""
    session, n_arm = state.session, len(state.session.arm.parameters)
    nothing = Perturbation.none(*q_rad.shape)
    frames = perturbed_frames(session.arm, state.geometry[:n_arm], q_rad, nothing)
    by = nothing
    for accepted in state.accepted:
        if moves_tool(accepted.term):
            basis = _basis(accepted, state.drivers, q_rad, frames, approach)
            if basis is None:
                return None
            by = by.plus(accepted.term.port, basis @ accepted.coefficients)
    return _tool(state, perturbed_frames(session.arm, state.geometry[:n_arm], q_rad, by)[:, -1])


def _basis(accepted: Accepted, drivers: Drivers, q_rad: Floats, frames: Floats, approach: Floats) -> Floats | None:
    """(pose, width, coefficient) of one term at the poses asked."""
    first = np.zeros(len(q_rad), dtype=np.intp)
    direct = carried_over(accepted, drivers, _asked(extended(drivers, q_rad, frames, first), approach, slice(None)))
    if direct is not None:
        return direct
    parts = [
        _among_copies(accepted, drivers, q_rad[i : i + COPIES], frames[i : i + COPIES], approach[i : i + COPIES])
        for i in range(0, len(q_rad), COPIES)
    ]
    known = [part for part in parts if part is not None]
    return np.concatenate(known) if len(known) == len(parts) else None


def _among_copies(
    accepted: Accepted, drivers: Drivers, q_rad: Floats, frames: Floats, approach: Floats
) -> Floats | None:
    """The same of a term that counts from the mean of its driver: a copy of the session, whose first sample stands at
    the pose asked, leaves the means what they were.
    """
    n, poses = len(drivers.q_rad), len(q_rad)
    slots = n * np.arange(poses)
    q, frame = np.tile(drivers.q_rad, (poses, 1)), np.tile(drivers.frames, (poses, 1, 1, 1))
    q[slots], frame[slots] = q_rad, frames
    wide = np.zeros((poses * n, approach.shape[1]))
    wide[slots] = approach
    copies = extended(drivers, q, frame, np.tile(np.arange(n), poses))
    found = carried_over(accepted, drivers, _asked(copies, wide, slots))
    return None if found is None else found[slots]


def _asked(drivers: Drivers, approach: Floats, slots: Ints | slice) -> Drivers:
    """With what was asked in place of what the first sample had, at slots of the poses behind the session's."""
    n = len(approach)

    def put(values: Floats, new: Floats) -> Floats:
        out = values.copy()
        out[len(out) - n :][slots] = new[slots]
        return out

    qd, load, lag = drivers.qd_rad_s, drivers.payload_kg, drivers.cmd_minus_q_rad
    return replace(
        drivers,
        approach=None if drivers.approach is None else put(drivers.approach, approach),
        last_move_rad=put(drivers.last_move_rad, MOVED_RAD * approach),
        qd_rad_s=None if qd is None else put(qd, np.zeros_like(approach)),
        cmd_minus_q_rad=None if lag is None else put(lag, np.zeros_like(approach)),
        payload_kg=None if load is None else put(load, np.zeros(n)),
    )


def _tool(state: Fitted, T_base_flange: Floats) -> Tool:
    """The laser where the session has one, else the target."""
    session = state.session
    for block, measured in enumerate(session.measured):
        chain = measured.problem.chain
        own = session.weighting.unweighted.of_block(block, state.geometry)[len(chain.model.parameters) :]
        beam = chain.sensor.beam(own, T_base_flange)
        if beam is not None:
            return LaserBeam(*beam)
    point_m = _drawn_point_m(state) + _corrections_m(state)
    return T_base_flange[:, :3, :3] @ point_m + T_base_flange[:, :3, 3]


def _drawn_point_m(state: Fitted) -> Floats:
    point_m = state.session.rig.tool.point_m
    return np.zeros(3) if point_m is None else np.array(point_m)


def _corrections_m(state: Fitted) -> Floats:
    """(3,) by which the fit has moved the target on the flange; zero where it has none."""
    found = {p.name: v for p, v in zip(state.session.parameters, state.geometry, strict=True)}
    return np.array([found.get(f"tool.{axis}", 0.0) for axis in "xyz"])


def write_asked(free_space: Mapping[str, Any], path: Path) -> None:
    """Joint readings and the side from which each joint came: standing, unloaded, as warm as at the first sample."""
    readings, approach = free_space["reading_rad"], free_space["approach"]
    joints = range(1, len(readings[0]) + 1)
    lines = [",".join([*(f"q{j}_rad" for j in joints), *(f"approach{j}" for j in joints)])]
    lines += [",".join(map(repr, [*q, *a])) for q, a in zip(readings, approach, strict=True)]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def read_asked(path: Path) -> tuple[Floats, Floats]:
    """Joint readings and approach, both (pose, joint), as the concealing side wrote them."""
    q_rad, approach = np.hsplit(np.loadtxt(path, delimiter=",", skiprows=1), 2)
    return q_rad, approach


def write_unseen(path: Path, before: Tool | None, after: Tool | None) -> None:
    """Geometry alone, and with the physics found."""
    parts: dict[str, Floats] = {}
    for name, tool in (("before", before), ("after", after)):
        if isinstance(tool, LaserBeam):
            parts |= {f"{name}_origin_m": tool.origin_m, f"{name}_direction": tool.direction}
        elif tool is not None:
            parts[f"{name}_tip_m"] = tool
    np.savez(path, **parts)  # pyright: ignore[reportArgumentType] - its keyword `allow_pickle` is not among them


def read_unseen(path: Path) -> tuple[Tool | None, Tool | None]:
    """What `write_unseen` wrote; nothing where there is no file."""
    if not path.is_file():
        return None, None
    with np.load(path) as parts:
        kept = {name: np.asarray(parts[name], dtype=np.float64) for name in parts.files}
    return _tool_in(kept, "before"), _tool_in(kept, "after")


def _tool_in(parts: dict[str, Floats], name: str) -> Tool | None:
    if f"{name}_origin_m" in parts:
        return LaserBeam(parts[f"{name}_origin_m"], parts[f"{name}_direction"])
    return parts.get(f"{name}_tip_m")
