"""The two detector faces as they are now: where the light is, how much of it, and in words what is wrong with it."""

from math import isfinite

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from acquisition.psd_view import NO_LIGHT, SATURATED, PsdView
from drivers.device import Block

NEWEST = 50  # samples at 1 kHz: longer than a look at 30 Hz, so that a mean sees them all


class FaceNow(Struct, frozen=True):
    """One face. `state`: "light", "saturated", "no light", or "no spot": light, but beyond the error map, or where no
    spot explains the currents. Positions (m) are None where there is none.
    """

    state: str
    x_m: float | None
    y_m: float | None
    sum_v: float
    half_m: float


def faces_now(view: PsdView, block: Block) -> tuple[FaceNow, FaceNow]:
    """Both faces by the newest samples: one spot of their averaged currents, as sessions average them."""
    current_a = block.values["photocurrent_a"][-NEWEST:].mean(axis=0)
    flags = block.values["flags"][-NEWEST:].astype(np.int64)
    newest, ever = int(flags[-1]), int(np.bitwise_or.reduce(flags))
    return _face(view, 0, current_a[:4], newest, ever), _face(view, 1, current_a[4:], newest, ever)


def _face(view: PsdView, k: int, current_a: NDArray[np.float64], newest: int, ever: int) -> FaceNow:
    """One spot; PsdView.each says the same of many samples, and would take twice the time of one."""
    face, error_map = view.faces[k], view.maps[k]
    reading = face.read(current_a)
    sum_v, half_m = round(float(reading.sum_a) * view.transimpedance_v_a, 4), 0.5 * face.length_m
    corrected = (reading.x_m, reading.y_m) if error_map is None else error_map.correct(reading.x_m, reading.y_m)
    x_m, y_m = (float(value) for value in corrected)
    if newest & NO_LIGHT[k]:
        return FaceNow("no light", None, None, sum_v, half_m)
    if not (isfinite(x_m) and isfinite(y_m)):
        return FaceNow("no spot", None, None, sum_v, half_m)
    return FaceNow("saturated" if ever & SATURATED[k] else "light", round(x_m, 9), round(y_m, 9), sum_v, half_m)


def measured_m(faces: tuple[FaceNow, FaceNow] | None) -> list[float] | None:
    """psd1 x, y, psd2 x, y (4,) where both are lit."""
    found = [value for face in faces or () for value in (face.x_m, face.y_m) if value is not None]
    return found if len(found) == 4 else None
