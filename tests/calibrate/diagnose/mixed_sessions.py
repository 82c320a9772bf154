"""Concealed sessions with more than one instrument, or a 6-D target: one arm, one hidden mechanism, seen every way.

The mechanisms and the arm are those of simulators/conceal; here only instruments are put together.
"""

from dataclasses import fields, replace

import numpy as np

from acquisition.recording import read
from simulators.arm.kinematics import inverse, turned
from simulators.conceal.case import conceal
from simulators.conceal.case_files import columns, csv_text
from simulators.conceal.observe import observe, postures, shaken_rad
from simulators.conceal.readings import stand
from simulators.conceal.rig import Artefacts
from simulators.conceal.rig_file import rig_document, toml_text
from simulators.conceal.wanted import Wanted

TURN_RAD = 2e-5  # one sigma of a 6-D target's orientation
CONTACT_M = 8e-6
PROBE_M = (0.01, 0.02, 0.08)  # of a laser's flange that carries a probe, too
MOUNTED = turned(np.array([0.3, -1.1, 0.7]))  # how the 6-D target is screwed on: the rig file does not say


def truth_of(case):
    """What was hidden: to judge, never to diagnose. KIND, physics and port."""
    return [(one.defect.PHYSICS, one.defect.port) for one in case.hidden]


def full_pose(folder, **wanted):
    """A tracker that sees the orientation, too. Recording, case."""
    case = conceal(Wanted("tracker", **wanted))
    true, rng = case.drawn.true, np.random.default_rng(case.wanted.seed)
    stance = stand(true, case.table.scene, [one.defect for one in case.hidden], case.posture_rad)
    seen = inverse(true.instrument.pose) @ stance.T_base_tool @ MOUNTED
    noise = turned(TURN_RAD * rng.standard_normal((len(seen), 3)))
    vectors = rotation_vectors((noise @ seen)[:, :3, :3])
    table = columns(case) | {f"r{axis}_rad": v.tolist() for axis, v in zip("xyz", vectors.T, strict=True)}
    return written(folder, rig_document(case.stated), table), case


def tracker_and_cones(folder, share=0.5, **wanted):
    """The last rows of a tracker's session are taken in cones instead."""
    case = conceal(Wanted("tracker", **wanted))
    table, rows = columns(case), len(case.table.scene)
    seated = np.arange(rows) >= rows - int(share * rows)
    rng = np.random.default_rng(case.wanted.seed)
    cones = Artefacts(_within_reach(case, 4, rng), 4, np.zeros(0), np.zeros(0, dtype=np.int64))
    reading, seat = _seated(case, case.drawn.true, cones, rng.integers(1, 5, int(seated.sum())), seated, rng)
    for name in ("x_m", "y_m", "z_m"):
        table[name] = [None if s else v for v, s in zip(table[name], seated, strict=True)]
    table = _with_joints(table, reading, seated)
    table["seat"] = _where(seat, seated)
    document = rig_document(case.stated)
    document["noise"]["seat_m"] = CONTACT_M
    return written(folder, document, table), case


def spots_and_bar(folder, holdings=20, **wanted):
    """A laser's session at whose end a probe on the same flange measures a bar."""
    case = conceal(Wanted("dual-psd", **wanted))
    table, rows = columns(case), len(case.table.scene)
    seated = np.arange(rows) >= rows - 2 * holdings
    rng = np.random.default_rng(case.wanted.seed)
    true = replace(case.drawn.true, tool_point_m=np.array(PROBE_M) + rng.normal(0.0, 5e-4, 3))
    ends, length_m = _bar_ends(replace(case, drawn=replace(case.drawn, true=true)), holdings, rng)
    bar = Artefacts(ends, 0, np.array([length_m]), np.zeros(holdings, dtype=np.int64))
    reading, _ = _seated(case, true, bar, np.arange(1, 2 * holdings + 1), seated, rng)
    nothing = ["psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m", "psd1_sum_v", "psd2_sum_v", "placement", "first_psd"]
    for name in [name for name in nothing if name in table]:
        table[name] = [None if s else v for v, s in zip(table[name], seated, strict=True)]
    table = _with_joints(table, reading, seated)
    table["bar"] = [1 if s else None for s in seated]
    table["bar_end"] = [None] * (rows - 2 * holdings) + ["a", "b"] * holdings
    document = rig_document(case.stated)
    document["tool"]["point_m"] = list(PROBE_M)
    document["bar"] = [{"id": 1, "length_m": length_m}]
    document["noise"]["seat_m"] = CONTACT_M
    return written(folder, document, table), case


def written(folder, document, table):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "rig.toml").write_text(toml_text(document), encoding="utf-8")
    (folder / "samples.csv").write_text(csv_text(table), encoding="utf-8", newline="")
    return read(folder)


def rotation_vectors(R):
    """(row, 3) by the quaternion's largest component, in plain algebra."""
    w = np.sqrt(np.maximum(1.0 + np.trace(R, axis1=1, axis2=2), 0.0)) / 2.0
    v = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1) / 2.0
    sine = np.linalg.norm(v, axis=1)
    angle = np.arctan2(sine, 2.0 * w**2 - 1.0)
    return v / np.maximum(sine, 1e-12)[:, None] * angle[:, None]


def _seated(case, true, artefacts, seat, seated, rng):
    """(row, n) readings with the probe in its seats, and those seats, of the rows that are seated."""
    scene, posture = case.table.scene, postures(true, artefacts.seat_m, seat, rng)
    if not np.isfinite(posture).all():
        raise ValueError(f"seed {case.wanted.seed}: a seat is out of reach; take another")
    there = {f.name: getattr(scene, f.name) for f in fields(scene)}
    there = {name: v[seated] if isinstance(v, np.ndarray) and len(v) == len(scene) else v for name, v in there.items()}
    there["temperature_degC"] = {k: v[seated] for k, v in scene.temperature_degC.items()}
    there["extra"] = {k: v[seated] for k, v in scene.extra.items()}
    moved = scene.last_move_rad[seated]
    own = replace(scene, **{**there, "goal_rad": posture, "via_rad": posture - moved, "seat": seat})
    rig = replace(true, instrument=artefacts)
    reading = observe(rig, own, [one.defect for one in case.hidden], posture).reading_rad
    return reading + shaken_rad(rig, reading, CONTACT_M * rng.standard_normal((len(reading), 3))), seat


def _within_reach(case, count, rng):
    """Places that the arm has been at, and can be at from other sides."""
    arm = case.drawn.true.arm
    frames = stand(case.drawn.true, case.table.scene, [], case.posture_rad).T_base_tool
    tips = frames[:, :3, :3] @ case.drawn.true.tool_point_m + frames[:, :3, 3]
    near = np.flatnonzero(np.linalg.norm(tips, axis=1) < np.median(np.linalg.norm(tips, axis=1)))
    assert arm.n_joints == 6
    return tips[rng.choice(near, count, replace=False)]


def _bar_ends(case, holdings, rng):
    """(2 holdings, 3) ends a, b in turn about places within reach, and the length."""
    middle = _within_reach(case, holdings, rng) * 0.8
    way = rng.standard_normal((holdings, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    length_m = 0.3
    return np.stack([middle - 0.5 * length_m * way, middle + 0.5 * length_m * way], axis=1).reshape(-1, 3), length_m


def _with_joints(table, reading, seated):
    out = dict(table)
    for j, values in enumerate(reading.T, start=1):
        column = np.array(table[f"q{j}_rad"])
        column[seated] = values
        out[f"q{j}_rad"] = column.tolist()
    if "repeat" in out:
        out["repeat"] = [None if s else v for v, s in zip(out["repeat"], seated, strict=True)]
    return {name: v for name, v in out.items() if not name.startswith("cmd")}


def _where(values, where):
    out = [None] * len(where)
    for row, value in zip(np.flatnonzero(where).tolist(), values.tolist(), strict=True):
        out[row] = value
    return out
