"""The noise of a simulated recording: what the rig of the recording states, else what the model found.

What the model found is all that scatters, the joints' repeatability with it. So it stands in for a stated noise that
leaves the joints out and is smaller.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import ORIENTATION, POSITION, SPOTS, WIRE, per_joint
from calibrate.model.model_file import ModelFile
from calibrate.model.sensors.camera import PLACE, TURN

Floats = NDArray[np.float64]


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
        stated = _beside(column)
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
    beside = _beside(column)
    if beside in samples and np.isfinite(samples.column(beside)).any():
        return float(np.nanmedian(samples.column(beside)))
    return stated


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, float | int) and not isinstance(value, bool) else None


def _beside(column: str) -> str:
    return column.removesuffix("_m") + "_sigma_m"
