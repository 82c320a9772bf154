"""From windows of photocurrents to spots: what a PSD box's samples mean, averaged as currents, not as positions."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Spot
from drivers.psd_daq.messages import FaceIdentity, Flag
from drivers.psd_faces import mean_face, read_face

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SATURATED = (Flag.PSD1_SATURATED, Flag.PSD2_SATURATED)
NO_LIGHT = (Flag.PSD1_NO_LIGHT, Flag.PSD2_NO_LIGHT)


@dataclass(frozen=True)
class PsdWindow:
    """Consecutive samples of a PSD box."""

    host_s: Floats  # (sample,)
    device_s: Floats  # (sample,)
    current_a: Floats  # (sample, 8)
    flags: Ints  # (sample,)
    temperature_degC: Floats  # (sample,)

    def between(self, from_s: float, to_s: float) -> "PsdWindow":
        """The samples taken in this stretch of device time, ends included."""
        keep = (self.device_s >= from_s) & (self.device_s <= to_s)
        return PsdWindow(
            self.host_s[keep], self.device_s[keep], self.current_a[keep], self.flags[keep], self.temperature_degC[keep]
        )


@dataclass(frozen=True)
class PsdView:
    """How to read the box: its two faces, and the volts of its sum signals."""

    faces: tuple[FaceIdentity, FaceIdentity]
    transimpedance_v_a: float

    def each(self, window: PsdWindow) -> Floats:
        """Spots of every sample, (sample, 4) m: psd1 x, y, psd2 x, y; NaN where the box saw no light."""
        columns: list[Floats] = []
        for k, face in enumerate(self.faces):
            reading = read_face(face.kind, window.current_a[:, 4 * k : 4 * k + 4], face.length_m)
            dark = (window.flags & NO_LIGHT[k]) != 0
            columns += [np.where(dark, np.nan, reading.x_m), np.where(dark, np.nan, reading.y_m)]
        return np.stack(columns, axis=1)

    def mean(self, window: PsdWindow) -> tuple[Spot, Spot]:
        """Both spots of the averaged currents. A face counts as dark when most samples of the window say so."""
        return self._mean(window, 0), self._mean(window, 1)

    def _mean(self, window: PsdWindow, k: int) -> Spot:
        face = self.faces[k]
        mean = mean_face(face.kind, window.current_a[:, 4 * k : 4 * k + 4], face.length_m)
        sum_v = mean.sum_a * self.transimpedance_v_a
        if np.mean((window.flags & NO_LIGHT[k]) != 0) > 0.5:
            return Spot(np.nan, np.nan, sum_v, np.nan, np.nan, lit=False)
        saturated = bool(np.any((window.flags & SATURATED[k]) != 0))
        return Spot(mean.x_m, mean.y_m, sum_v, mean.x_sigma_m, mean.y_sigma_m, lit=True, saturated=saturated)
