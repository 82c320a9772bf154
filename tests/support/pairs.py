"""Two recordings of one concealed rig: between them something has been changed."""

import csv
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from calibeam.cli import run
from simulators.arm.kinematics import moved, shifted, turned_about
from simulators.conceal.observe import observe
from simulators.conceal.rig import DualPsd, TrueRig
from tests.support.halves import OBSERVED, written_halves

ZERO = np.zeros(3)
Change = Callable[[TrueRig], TrueRig]
WANTED = {  # enough rows for both halves
    "dual-psd": {"samples": 400},
    "tracker": {"samples": 300},
    "wire": {"samples": 800},
    "cones": {"samples": 400},
}


def unchanged(rig: TrueRig) -> TrueRig:
    return rig


def zero(joint: int, by_rad: float) -> Change:
    def change(rig: TrueRig) -> TrueRig:
        off = by_rad * (np.arange(rig.arm.n_joints) == joint - 1)
        return replace(rig, arm=replace(rig.arm, zero_rad=rig.arm.zero_rad + off))

    return change


def link(i: int, axes: np.ndarray) -> Change:
    """Six numbers behind joint i, along and about its axes there: see `calibrate.model.effects.moved`."""

    def change(rig: TrueRig) -> TrueRig:
        fixed = np.array(rig.arm.fixed)
        fixed[i] = fixed[i] @ moved(axes[:3], axes[3:])
        return replace(rig, arm=replace(rig.arm, fixed=fixed))

    return change


def tool(by_m: np.ndarray) -> Change:
    return lambda rig: replace(rig, tool_point_m=rig.tool_point_m + by_m)


def instrument(**fields: Callable[[np.ndarray], np.ndarray]) -> Change:
    """Each named part of the instrument by its own function."""

    def change(rig: TrueRig) -> TrueRig:
        own = rig.instrument
        return replace(rig, instrument=replace(own, **{k: f(getattr(own, k)) for k, f in fields.items()}))

    return change


def place(k: int, by_m: np.ndarray, about_rad: np.ndarray = ZERO, point_m: np.ndarray = ZERO) -> Change:
    """Fixture at its place k, along the axes of the base, and turned about a point of the base."""
    motion = shifted(by_m) @ turned_about(point_m, about_rad)
    return instrument(places=lambda T: np.stack([motion @ P if i == k - 1 else P for i, P in enumerate(T)]))


def seat(k: int, by_m: np.ndarray) -> Change:
    return instrument(seat_m=lambda x: x + by_m * (np.arange(len(x)) == k - 1)[:, None])


def laser(by_m: np.ndarray, about_rad: np.ndarray) -> Change:
    """As a body that is turned about the centre of the flange, and shifted."""
    T = moved(by_m, about_rad)
    return instrument(
        laser_origin_m=lambda x: T[:3, :3] @ x + T[:3, 3],
        laser_direction=lambda d: T[:3, :3] @ d,
    )


def laser_line(nominal: DualPsd, own: DualPsd) -> np.ndarray:
    """(4,) shifts and tilts of a laser's line about the believed one, across it: numbers of `laser.…` in a model.

    Where the line crosses the plane of the believed origin; axis u is the flange axis most across the believed beam.
    """
    d = nominal.laser_direction / np.linalg.norm(nominal.laser_direction)
    axis = np.eye(3)[int(np.argmin(np.abs(d)))]
    u = (axis - (axis @ d) * d) / np.linalg.norm(axis - (axis @ d) * d)
    v = np.cross(d, u)
    along = own.laser_direction / (own.laser_direction @ d)
    away = own.laser_origin_m - nominal.laser_origin_m
    away = away - (away @ d) * along
    return np.array([away @ u, away @ v, along @ u, along @ v])


def device(by_m: np.ndarray, about_rad: np.ndarray) -> Change:
    return instrument(pose=lambda T: T @ moved(by_m, about_rad))


def all_at_once(*changes: Change) -> Change:
    def change(rig: TrueRig) -> TrueRig:
        for one in changes:
            rig = one(rig)
        return rig

    return change


class Pair:
    """A recording, its model, and what a later recording says after a change; each in its own folder."""

    def __init__(self, folder: Path, **wanted: object) -> None:
        self.folder, self.family = folder, str(wanted["family"])
        _, _, self.case, self.unseen = written_halves(folder, **(WANTED[self.family] | wanted))
        self.model = folder / "model.json"
        arguments = ["diagnose", str(folder / "recording"), "--out", str(folder / "diagnosis.json")]
        assert run([*arguments, "--model-out", str(self.model)]) == 0

    def later(self, name: str, change: Change = unchanged) -> Path:
        """The rows that the model has not seen, taken after the change, with the noise of the concealed session."""
        case = self.case
        rig, defects = change(case.drawn.true), [one.defect for one in case.hidden]
        exact = observe(rig, case.table.scene, defects, case.posture_rad, wire=self.family == "wire")
        noise_rad = case.reading_rad - case.exact.reading_rad
        reading_rad = exact.reading_rad + noise_rad
        values_m = exact.values_m + (case.values_m - case.exact.values_m)
        out = self.folder / name
        out.mkdir()
        shutil.copy(self.folder / "recording" / "rig.toml", out)
        header, *rows = list(csv.reader((self.folder / "unseen.csv").read_text().splitlines()))
        at = np.flatnonzero(self.unseen)
        for row, k in zip(rows, at.tolist(), strict=True):
            for j in range(reading_rad.shape[1]):
                row[header.index(f"q{j + 1}_rad")] = repr(float(reading_rad[k, j]))
            for j, column in enumerate(OBSERVED[self.family] if self.family != "cones" else ()):
                row[header.index(column)] = repr(float(values_m[k, j]))
        with (out / "samples.csv").open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([header, *rows])
        return out
