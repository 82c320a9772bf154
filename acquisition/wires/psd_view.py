"""From windows of photocurrents to spots: what a PSD box's samples mean, averaged as currents, not as positions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Spot
from drivers.device import Block
from drivers.psd_daq.messages import Flag
from drivers.psd_error_map import ErrorMap
from drivers.psd_faces import Face

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
    temperature_degC: Floats  # (sample,), or empty: this instrument measures none

    def mean_temperature(self) -> dict[str, float]:
        """Under the name "psd", when there is one."""
        return {"psd": float(self.temperature_degC.mean())} if len(self.temperature_degC) else {}

    def between(self, from_s: float, to_s: float) -> "PsdWindow":
        """The samples taken in this stretch of device time, ends included."""
        keep = (self.device_s >= from_s) & (self.device_s <= to_s)
        temperature_degC = self.temperature_degC[keep] if len(self.temperature_degC) else self.temperature_degC
        return PsdWindow(
            self.host_s[keep], self.device_s[keep], self.current_a[keep], self.flags[keep], temperature_degC
        )


def psd_window(blocks: Sequence[Block]) -> PsdWindow:
    """The samples of consecutive blocks of a PSD instrument, at least one."""

    def column(name: str) -> NDArray[np.float64]:
        return np.concatenate([block.values[name] for block in blocks])

    return PsdWindow(
        np.concatenate([block.host_s for block in blocks]),
        np.concatenate([block.device_s for block in blocks]),
        column("photocurrent_a"),
        column("flags").astype(np.int64),
        column("temperature_degC") if "temperature_degC" in blocks[0].values else np.empty(0),
    )


@dataclass(frozen=True)
class PsdView:
    """How to read the box: its two faces, the volts of its sum signals, and the measured error maps of the faces."""

    faces: tuple[Face, Face]
    transimpedance_v_a: float
    maps: tuple[ErrorMap | None, ErrorMap | None] = (None, None)

    def each(self, window: PsdWindow) -> Floats:
        """Spots of every sample, (sample, 4) m: psd1 x, y, psd2 x, y; NaN where the box saw no light."""
        columns: list[Floats] = []
        for k, face in enumerate(self.faces):
            reading = face.read(window.current_a[:, 4 * k : 4 * k + 4])
            x_m, y_m = _corrected(self.maps[k], reading.x_m, reading.y_m)
            dark = (window.flags & NO_LIGHT[k]) != 0
            columns += [np.where(dark, np.nan, x_m), np.where(dark, np.nan, y_m)]
        return np.stack(columns, axis=1)

    def mean(self, window: PsdWindow) -> tuple[Spot, Spot]:
        """Both spots of the averaged currents. A face counts as dark when most samples of the window are."""
        return self._mean(window, 0), self._mean(window, 1)

    def _mean(self, window: PsdWindow, k: int) -> Spot:
        mean = self.faces[k].mean(window.current_a[:, 4 * k : 4 * k + 4])
        sum_v = mean.sum_a * self.transimpedance_v_a
        if np.mean((window.flags & NO_LIGHT[k]) != 0) > 0.5:
            return Spot(np.nan, np.nan, sum_v, np.nan, np.nan, lit=False)
        saturated = bool(np.any((window.flags & SATURATED[k]) != 0))
        x_m, y_m = _corrected(self.maps[k], np.array(mean.x_m), np.array(mean.y_m))
        return Spot(float(x_m), float(y_m), sum_v, mean.x_sigma_m, mean.y_sigma_m, lit=True, saturated=saturated)


def _corrected(error_map: ErrorMap | None, x_m: Floats, y_m: Floats) -> tuple[Floats, Floats]:
    """By the map, if there is one. Its slope differs from 1 by some per cent: sigmas are left as they are."""
    return (x_m, y_m) if error_map is None else error_map.correct(x_m, y_m)
