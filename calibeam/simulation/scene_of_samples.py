"""What the samples of a recording were exposed to, as the simulators take it, and the noise of a simulated recording:
what the rig of the recording states, else what the model found.

What the model found is all that scatters, the joints' repeatability with it. So it stands in for a stated noise that
leaves the joints out and is smaller.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import ORIENTATION, POSITION, SEAT, SPOTS, WIRE, per_joint
from calibrate.model.effects.conditions import (
    conditions_of,
    temperatures_of,
)
from calibrate.model.model_file import ModelFile
from calibrate.model.sensors.camera import PLACE, TURN
from simulators.defects import Scene

Floats = NDArray[np.float64]
LONG_RAD = 0.05  # a last move whose length nobody wrote down: longer than any play


@dataclass(frozen=True)
class Clock:
    """The session that mechanisms count their times and temperatures from."""

    first_s: float  # on the clock of the recording
    last_s: float
    rest_degC: Mapping[str, float]  # by place: at which the geometry is stated

    @classmethod
    def of(cls, model: ModelFile, t_s: Floats) -> "Clock":
        """Of a model; of the samples (row,) themselves for one without a session."""
        if model.session is None:
            return cls(float(t_s.min()), float(t_s.max()), {})
        return cls(model.session.first_t_s, model.session.last_t_s, rest_degC(model))


def scene_of(samples: Samples, clock: Clock, *, same_recording: bool) -> Scene:
    """One row a sample; the samples of another recording come after the end of the clock's session."""
    taken = conditions_of(samples, temperatures_of(samples))
    rows, n = len(samples), samples.n_joints
    q, none = taken.q_rad, np.zeros(rows)
    side = taken.last_move_rad if taken.approach is None else taken.approach
    whole = np.full(rows, 0, dtype=np.int64)
    extra = dict(taken.extra)
    if taken.psd_sum_v is not None:
        extra |= {"psd1_sum": taken.psd_sum_v[:, 0], "psd2_sum": taken.psd_sum_v[:, 1]}
    return Scene(
        t_s=taken.t_s - clock.first_s if same_recording else np.full(rows, clock.last_s - clock.first_s),
        via_rad=q - np.sign(side) * np.maximum(np.abs(taken.last_move_rad), LONG_RAD),
        goal_rad=q,
        qd_rad_s=np.zeros((rows, n)) if taken.qd_rad_s is None else taken.qd_rad_s,
        wait_s=none,
        payload_kg=none if taken.payload_kg is None else taken.payload_kg,
        payload_com_m=np.zeros(3) if taken.payload_com_m is None else taken.payload_com_m,
        placement=samples.integers("placement", 0) if "placement" in samples else whole,
        first_psd=samples.integers("first_psd", 0) if "first_psd" in samples else whole,
        seat=samples.integers(SEAT, 0) if SEAT in samples else whole,
        temperature_degC=taken.temperatures_degC,
        laser_power=np.ones(rows),
        extra=extra,
        rest_degC=clock.rest_degC,
        moved_rad=taken.last_move_rad,
        asked_rad=taken.cmd_minus_q_rad,
        laser_sum_v=taken.psd_sum_v,
    )


def rest_degC(model: ModelFile) -> dict[str, float]:
    """By place: the mean over the model's session, at which its geometry is stated."""
    if model.session is None:
        return {}
    out: dict[str, float] = {}
    for name, values in model.session.conditions.items():
        if name.startswith("temp_") and name.endswith("_degC"):
            known = [value for value in values if value is not None]
            if known:
                out[name.removeprefix("temp_").removesuffix("_degC")] = float(np.mean(known))
    return out


@dataclass(frozen=True, eq=False)
class Noise:
    """One sigma by column, of the joints' repeatability, and of a probe in its cone; zero: none is known."""

    sigma: Mapping[str, float]
    joint_rad: float
    seat_m: float
    found: tuple[str, ...]  # columns whose sigma nobody states: it is what the model found
    silent: tuple[str, ...]  # columns without either

    def of(self, column: str, samples: Samples) -> Floats:
        """(row,) of a column; a sigma that stands beside a reading goes before all others."""
        stated = _sigma_column(column)
        usual = np.full(len(samples), self.sigma.get(column, 0.0))
        if stated not in samples or column in self.found:
            return usual
        own = samples.column(stated)
        return np.where(np.isfinite(own), own, usual)

    def drawn(self, samples: Samples, rng: np.random.Generator) -> Samples:
        """With normal noise on every reading, independent of each other."""
        columns = dict(samples.columns)
        for name in self.sigma:
            if name in samples:
                columns[name] = samples.column(name) + self.of(name, samples) * rng.standard_normal(len(samples))
        return Samples(columns, samples.n_joints)


def noise_of(rig: Rig, model: ModelFile, samples: Samples, *, as_found: bool = False) -> Noise:
    """For the columns that the samples have; `as_found`: what the model found goes before what is stated."""
    stated = rig.noise
    by_column: dict[str, float | None] = dict.fromkeys(SPOTS, stated.psd_m)
    by_column |= dict.fromkeys(POSITION, stated.position_m) | {WIRE: stated.wire_m}
    by_column |= dict.fromkeys(ORIENTATION) | dict.fromkeys(per_joint("enc", "_rad", samples.n_joints))
    by_column |= dict(zip(PLACE, stated.camera_m or (None,) * 3, strict=True))
    by_column |= dict(zip(TURN, stated.camera_rad or (None,) * 3, strict=True))
    sigma: dict[str, float] = {}
    found: list[str] = []
    silent: list[str] = []
    for name, value in by_column.items():
        if name not in samples or not np.isfinite(samples.column(name)).any():
            continue
        its = _number(model.noise.get(name))
        drawn = _typical(name, value, samples)
        enough = stated.joint_rad is not None or its is None or drawn is None or its <= drawn
        if drawn is not None and (its is None or (enough and not as_found)):
            sigma[name] = drawn
        elif its is not None:
            sigma[name] = its
            found.append(name)
        else:
            sigma[name] = 0.0
            silent.append(name)
    shaken = not as_found or not found  # what was found holds the joints, too
    return Noise(sigma, (stated.joint_rad or 0.0) if shaken else 0.0, stated.seat_m or 0.0, tuple(found), tuple(silent))


def _typical(column: str, stated: float | None, samples: Samples) -> float | None:
    """As it stands beside the readings, in the middle; else as the rig states it."""
    sigma_column = _sigma_column(column)
    if sigma_column in samples and np.isfinite(samples.column(sigma_column)).any():
        return float(np.nanmedian(samples.column(sigma_column)))
    return stated


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, float | int) and not isinstance(value, bool) else None


def _sigma_column(column: str) -> str:
    return column.removesuffix("_m") + "_sigma_m"
