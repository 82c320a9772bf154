"""Sessions of any machine: arms of 1 to 7 joints, one to six instruments, masses, sections and columns there or not.

Nothing here is meant to be diagnosed well; whatever is drawn, a diagnosis has to end in a verdict or in a clear
refusal. Plain 4x4 products, no code of calibrate: an angle that the arm has, and another one that it reports.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simulators.conceal.case_files import csv_text
from simulators.conceal.rig_file import toml_text

Floats = NDArray[np.float64]

INSTRUMENTS = ("tracker", "pose", "wire", "camera", "second encoders", "spots", "cones")
NOISE_M, NOISE_RAD, NOISE_ENCODER_RAD = 3e-5, 3e-5, 1e-5
FACE_M = 0.05
SWEEP_RAD = 0.12  # about a posture whose beam meets both faces
TRIES = 40  # draws of postures for one that a fixture is hit from
STEPS = 30  # of Newton to a cone
ARTICULATIONS = 4  # in a cone, at least


@dataclass(frozen=True)
class Drawn:
    """A rig file's content and the columns of its samples; `None` is an empty cell."""

    rig: dict
    columns: dict[str, list]

    def write(self, folder: Path) -> Path:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "rig.toml").write_text(toml_text(self.rig), encoding="utf-8")
        (folder / "samples.csv").write_text(csv_text(self.columns), encoding="utf-8", newline="")
        return folder


@dataclass
class Machine:
    """An arm as it is, with what it carries and what stands about it."""

    links: Floats  # (joint, 4) theta, d, a, alpha
    point_m: Floats
    T_base_device: Floats
    laser: tuple[Floats, Floats]
    faces: list[Floats] = field(default_factory=list)

    def flange(self, q_rad: Floats) -> Floats:
        """(row, 4, 4)"""
        T = np.tile(np.eye(4), (len(q_rad), 1, 1))
        for angle, (offset, d, a, alpha) in zip(q_rad.T, self.links, strict=True):
            turn = np.tile(np.eye(4), (len(q_rad), 1, 1))
            turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle + offset)
            turn[:, 1, 0] = np.sin(angle + offset)
            turn[:, 0, 1] = -turn[:, 1, 0]
            T = T @ turn @ frame([a, 0.0, d], [alpha, 0.0, 0.0])
        return T

    def tips(self, q_rad: Floats) -> Floats:
        """(row, 3) of the target in the base."""
        return (self.flange(q_rad) @ np.append(self.point_m, 1.0))[:, :3]

    def spots(self, flange: Floats, first: int) -> Floats | None:
        """(4,) of one beam; None where it misses."""
        at, along = (flange @ np.append(self.laser[0], 1.0))[:3], flange[:3, :3] @ self.laser[1]
        out = np.zeros(4)
        for k in (first - 1, 2 - first):
            face = self.faces[k]
            fall = along @ face[:3, 2]
            if abs(fall) < 0.05:
                return None
            way = ((face[:3, 3] - at) @ face[:3, 2]) / fall
            at = at + way * along
            out[2 * k : 2 * k + 2] = face[:3, :2].T @ (at - face[:3, 3])
            if way <= 0.0:
                return None
            along = along - 2.0 * fall * face[:3, 2]
        return out if np.all(np.abs(out) < FACE_M) else None


def drawn(seed: int, most_rows: int = 2000) -> Drawn:
    """Session `seed`, of 5 to `most_rows` rows."""
    rng = np.random.default_rng([seed, 19])
    n = int(rng.integers(1, 8))
    least = 5.0 if rng.random() < 0.1 else 20.0
    rows = int(np.exp(rng.uniform(np.log(least), np.log(most_rows + 0.99))))
    used = rng.permutation(INSTRUMENTS)[: int(rng.integers(1, 7))].tolist()
    machine, rig = _machine(rng, n)
    q_rad = rng.uniform(-2.0, 2.0, (rows, n)) * rng.choice([1.0, 0.6, 0.15])
    if rng.random() < 0.15:
        q_rad[:, int(rng.integers(n))] = 0.3  # a joint that never moves
    kind = rng.choice(used, rows) if rng.random() < 0.5 else np.full(rows, "any")
    columns: dict[str, list] = {"t_s": np.sort(rng.uniform(0.0, 20.0 * rows, rows)).round(3).tolist()}
    readings: dict[str, list] = {}
    if "spots" in used and _fixture(machine, rig, rng, n):
        readings |= _spots(machine, q_rad, kind, rng)
    if "cones" in used and n >= 3:
        readings |= _cones(machine, q_rad, kind, rng)
    repeat = _repeats(q_rad, readings, rng)
    scene = _scene(rng, columns, q_rad)
    true = q_rad + _hidden(rng, q_rad, scene, columns)
    readings |= _free_readings(machine, true, used, kind, rng)
    if "second encoders" in used:
        enc = q_rad + rng.normal(0.0, NOISE_ENCODER_RAD, q_rad.shape) + rng.uniform(-0.1, 0.1, n)
        readings |= {f"enc{j + 1}_rad": enc[:, j].tolist() for j in range(n)}
    columns |= {f"q{j + 1}_rad": q_rad[:, j].tolist() for j in range(n)} | repeat | scene | readings
    _noise_and_tolerance(rig, rng)
    return Drawn(rig, columns)


def frame(origin_m, rotation_rad) -> Floats:
    """(4, 4) from origin and rotation vector."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(rotation_rad).as_matrix()
    T[:3, 3] = origin_m
    return T


def _machine(rng, n: int) -> tuple[Machine, dict]:
    square = rng.choice([-np.pi / 2.0, 0.0, np.pi / 2.0], n)
    links = np.column_stack([np.zeros(n), rng.uniform(0.0, 0.4, n), rng.uniform(0.0, 0.4, n), square])
    links[rng.random((n, 4)) < 0.2] = 0.0
    point = rng.uniform(-0.1, 0.15, 3)
    device = (rng.uniform(-1.5, 1.5, 3), rng.uniform(-1.5, 1.5, 3))
    along = rng.normal(size=3)
    machine = Machine(
        links + np.column_stack([np.zeros(n), *rng.normal(0.0, 3e-4, (3, n))]),
        point + rng.normal(0.0, 1e-3, 3),
        frame(*device),
        (rng.uniform(-0.05, 0.05, 3), along / np.linalg.norm(along)),
    )
    joints = []
    for _, d, a, alpha in links.tolist():
        joint = {"a_m": a, "alpha_rad": alpha, "d_m": d, "lower_rad": -3.5, "upper_rad": 3.5}
        if rng.random() < 0.5:
            joint["mass_kg"] = float(rng.uniform(0.2, 20.0))
            if rng.random() < 0.7:
                joint["com_m"] = rng.uniform(-0.2, 0.2, 3).tolist()
        if rng.random() < 0.4:
            joint["gear_ratio"] = float(rng.choice([50.0, 101.0, 160.0]))
        joints.append(joint)
    tool: dict = {"point_m": point.tolist()} if rng.random() < 0.8 else {}
    if rng.random() < 0.5:
        tool |= {"mass_kg": float(rng.uniform(0.1, 3.0)), "com_m": rng.uniform(-0.1, 0.1, 3).tolist()}
    tool |= {"laser_origin_m": machine.laser[0].tolist(), "laser_direction": machine.laser[1].tolist()}
    rig = {"schema": 1, "name": "drawn", "arm": {"model": "dh", "joint": joints}, "tool": tool}
    if rng.random() < 0.3:
        rig["arm"]["gravity_m_s2"] = rng.choice([[0.0, 0.0, 9.81], [9.81, 0.0, 0.0]]).tolist()
    if rng.random() < 0.7:
        rig["device"] = {"origin_m": device[0].round(3).tolist(), "rotation_rad": device[1].round(3).tolist()}
    return machine, rig


def _noise_and_tolerance(rig: dict, rng) -> None:
    stated = {"position_m": NOISE_M, "wire_m": NOISE_M, "psd_m": 5e-6, "seat_m": NOISE_M, "joint_rad": 1e-5}
    rig["noise"] = {key: value for key, value in stated.items() if rng.random() < (0.3 if key == "joint_rad" else 0.7)}
    if rng.random() < 0.5:
        rig["tolerance"] = {"length_m": 5e-4, "angle_rad": 1e-3}


def _fixture(machine: Machine, rig: dict, rng, n: int) -> bool:
    """A fixture about a posture from which the beam meets both faces."""
    for _ in range(TRIES):
        flange = machine.flange(rng.uniform(-1.0, 1.0, (1, n)))[0]
        at, along = (flange @ np.append(machine.laser[0], 1.0))[:3], flange[:3, :3] @ machine.laser[1]
        centre, normal = at + 0.2 * along, -along + rng.normal(0.0, 0.2, 3)
        one = np.eye(4)
        one[:3, :3] = Rotation.align_vectors([normal], [[0.0, 0.0, 1.0]])[0].as_matrix()
        one[:3, 3] = centre
        away = along - 2.0 * (along @ one[:3, 2]) * one[:3, 2]
        two = np.eye(4)
        two[:3, :3] = Rotation.align_vectors([-away + rng.normal(0.0, 0.2, 3)], [[0.0, 0.0, 1.0]])[0].as_matrix()
        two[:3, 3] = centre + 0.08 * away
        machine.faces[:] = [one, two]
        if machine.spots(flange, 1) is not None:
            inside = np.linalg.inv(one) @ two
            rig["fixture"] = {"half_size_m": FACE_M, "psd2_in_psd1": _six(inside)}
            rig["placement"] = [{"id": 1, "psd1_in_base": _six(one)}]
            return True
    return False


def _six(T: Floats) -> dict:
    return {"origin_m": T[:3, 3].tolist(), "rotation_rad": Rotation.from_matrix(T[:3, :3]).as_rotvec().tolist()}


def _spots(machine: Machine, q_rad: Floats, kind, rng) -> dict[str, list]:
    """Postures near one that strikes both faces take the place of those that were drawn."""
    rows, n = q_rad.shape
    names = ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m", "placement", "first_psd")
    out: dict[str, list] = {name: [None] * rows for name in names}
    middle = next(
        (q for q in rng.uniform(-1.0, 1.0, (4000, n)) if machine.spots(machine.flange(q[None])[0], 1) is not None), None
    )
    if middle is None:
        return {}
    for i in np.flatnonzero(np.isin(kind, ["any", "spots"])):
        q = middle + rng.uniform(-SWEEP_RAD, SWEEP_RAD, n)
        found = machine.spots(machine.flange(q[None])[0], 1)
        if found is None:
            continue
        q_rad[i] = q
        for name, value in zip(names, (*(found + rng.normal(0.0, 5e-6, 4)).tolist(), 1, 1), strict=True):
            out[name][i] = value
    return out


def _cones(machine: Machine, q_rad: Floats, kind, rng) -> dict[str, list]:
    """Newton brings the tip into one of three cones from wherever a row was drawn."""
    rows, n = q_rad.shape
    seats = machine.tips(rng.uniform(-1.0, 1.0, (3, n)))
    out: list[int | None] = [None] * rows
    for i in np.flatnonzero(np.isin(kind, ["cones"])):
        seat, q = int(rng.integers(3)), q_rad[i].copy()
        for _ in range(STEPS):
            error = machine.tips(q[None])[0] - seats[seat]
            J = (machine.tips(q + 1e-6 * np.eye(n)) - machine.tips(q[None])).T / 1e-6
            q -= np.clip(J.T @ np.linalg.solve(J @ J.T + 1e-9 * np.eye(3), error), -0.3, 0.3)
        if np.linalg.norm(machine.tips(q[None])[0] - seats[seat]) < 1e-6 and np.all(np.abs(q) < 3.4):
            q_rad[i], out[i] = q + rng.normal(0.0, 2e-5, n), seat + 1
    held = {seat for seat in (1, 2, 3) if out.count(seat) >= ARTICULATIONS}
    return {"seat": [seat if seat in held else None for seat in out]} if held else {}


def _repeats(q_rad: Floats, readings: dict[str, list], rng) -> dict[str, list]:
    """Some postures once more; their readings of a fixture or a cone go along."""
    rows = len(q_rad)
    if rows < 10 or rng.random() < 0.5:
        return {}
    out: list[int | None] = [None] * rows
    for group in range(min(rows // 8, 12)):
        some = rng.choice(rows, 3, replace=False)
        for i in some[1:]:
            q_rad[i] = q_rad[some[0]]
            for values in readings.values():
                values[i] = values[some[0]]
        for i in some:
            out[i] = group + 1
    return {"repeat": out}


def _scene(rng, columns: dict[str, list], q_rad: Floats) -> dict[str, list]:
    """Columns of conditions, each there or not; some with empty cells, some constant."""
    rows, n = q_rad.shape
    t_s, out = np.array(columns["t_s"]), dict[str, list]()
    each: dict[str, Callable[[], Floats]] = {
        "approach": lambda: rng.choice([-1.0, 1.0], (rows, n)),
        "last_move": lambda: np.diff(q_rad, axis=0, prepend=q_rad[:1]),
        "cmd": lambda: q_rad + rng.normal(0.0, 1e-5, (rows, n)),
        "qd": lambda: rng.normal(0.0, 0.05, (rows, n)),
    }
    for stem, unit in (("approach", ""), ("last_move", "_rad"), ("cmd", "_rad"), ("qd", "_rad_s")):
        if rng.random() < 0.35:
            values = each[stem]()
            out |= {f"{stem}{j + 1}{unit}": values[:, j].tolist() for j in range(n)}
    if rng.random() < 0.35:
        out["payload_kg"] = rng.choice([0.0, 1.0, 5.0], rows).tolist()
        if rng.random() < 0.5:
            out |= {f"payload_com_{axis}_m": np.full(rows, 0.05).tolist() for axis in "xyz"}
    for place in ("room", "laser", "joint1", f"joint{n}", "link1", f"link{n}", "device"):
        if rng.random() < 0.2:
            warm = 20.0 + 3.0 * (1.0 - np.exp(-t_s / (1.0 + t_s[-1] / 3.0))) + rng.normal(0.0, 0.1, rows)
            out[f"temp_{place}_degC"] = (np.full(rows, 20.0) if rng.random() < 0.2 else warm).tolist()
    if rng.random() < 0.3:
        out["fan_rpm"] = rng.normal(1000.0, 50.0, rows).tolist()
    if rng.random() < 0.2:
        out["batch"] = rng.integers(1, 4, rows).tolist()
    for name in [name for name in out if rng.random() < 0.1]:
        out[name] = [None if rng.random() < 0.2 else value for value in out[name]]
    return out


def _hidden(rng, q_rad: Floats, scene: dict[str, list], columns: dict[str, list]) -> Floats:
    """(row, joint) by which the arm is off what it reports: nothing, or one to three causes."""
    rows, n = q_rad.shape
    off = np.zeros((rows, n))
    t_s = np.array(columns["t_s"])
    for _ in range(int(rng.choice([0, 1, 1, 2, 3]))):
        j, size = int(rng.integers(n)), float(rng.choice([5e-5, 3e-4, 5e-3]))
        match int(rng.integers(5)):
            case 0:
                off[:, j] += size * np.sin(q_rad[:, j] + 0.4)
            case 1:
                off[:, j] += size * (t_s > np.median(t_s))
            case 2:
                off[:, j] += size * np.sin(2.0 * q_rad[:, j]) * np.cos(q_rad[:, (j + 1) % n])
            case 3 if f"approach{j + 1}" in scene:
                off[:, j] += size * np.array([value or 0.0 for value in scene[f"approach{j + 1}"]])
            case _:
                off[rng.integers(rows, size=max(rows // 30, 1)), j] += 10.0 * size
    return off


def _free_readings(machine: Machine, true_rad: Floats, used: list[str], kind, rng) -> dict[str, list]:
    """What stands in the room sees."""
    flange, rows = machine.flange(true_rad), len(true_rad)
    T_tool = flange.copy()
    T_tool[:, :3, 3] = machine.tips(true_rad)
    seen = np.linalg.inv(machine.T_base_device) @ T_tool
    out: dict[str, list] = {}

    def there(name: str) -> NDArray[np.bool_]:
        return np.isin(kind, ["any", name])

    def put(names, values: Floats, where: NDArray[np.bool_]) -> None:
        for name, column in zip(names, values.T.tolist(), strict=True):
            old = out.get(name, [None] * rows)
            out[name] = [v if w else o for v, w, o in zip(column, where, old, strict=True)]

    if "tracker" in used or "pose" in used:
        where = there("tracker") & ("tracker" in used) | there("pose") & ("pose" in used)
        put(("x_m", "y_m", "z_m"), seen[:, :3, 3] + rng.normal(0.0, NOISE_M, (rows, 3)), where)
    if "pose" in used:
        turned = Rotation.from_matrix(seen[:, :3, :3]) * Rotation.from_rotvec([0.2, -0.4, 0.9])
        noisy = (Rotation.from_rotvec(rng.normal(0.0, NOISE_RAD, (rows, 3))) * turned).as_rotvec()
        put(("rx_rad", "ry_rad", "rz_rad"), noisy, there("pose"))
    if "wire" in used:
        length = np.linalg.norm(seen[:, :3, 3], axis=1) + rng.normal(0.0, NOISE_M, rows)
        put(("wire_m",), length[:, None], there("wire"))
    if "camera" in used:
        body = (
            np.linalg.inv(frame([0.3, -2.0, 1.0], [1.2, 0.1, 0.0])) @ flange @ frame([0.02, 0.05, 0.1], [0.1, 0.3, 0])
        )
        put([f"camera_{a}_m" for a in "xyz"], body[:, :3, 3] + rng.normal(0.0, 1e-4, (rows, 3)), there("camera"))
        noisy = Rotation.from_matrix(body[:, :3, :3]) * Rotation.from_rotvec(rng.normal(0.0, 1e-3, (rows, 3)))
        put([f"camera_r{a}_rad" for a in "xyz"], noisy.as_rotvec(), there("camera"))
    return out
