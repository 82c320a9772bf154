"""The streams of a recording beside its diagnosis: what is wrong with them, by the model that was fitted.

Where a fitted model has the spots at any moment of the motion: where the beam falls on both faces.
"""

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording
from calibrate.diagnose.state.fitted import Fitted
from calibrate.diagnose.streams.between_encoders import causes_of
from calibrate.diagnose.streams.examine import Predicted, StreamReport, examine
from calibrate.diagnose.streams.recorded import devices_of
from calibrate.diagnose.streams.sample_times import Around, around, sample_windows
from calibrate.model.predict import Predictor

Floats = NDArray[np.float64]

ORDERS = (1, 2)


def streams_of(recording: Recording, fitted: Fitted | None) -> StreamReport | None:
    """None where no stream was recorded. Without a fit the clock of the spots stays open."""
    devices = devices_of(recording)
    if not devices:
        return None
    windows, predicted = sample_windows(recording), None
    if fitted is not None and "spots" in devices and "joints" in devices:
        placed = around(recording, windows, devices["spots"], devices["joints"])
        predicted = None if placed is None else predicted_spots(fitted, placed)
    return examine(devices, predicted, windows, None if fitted is None else causes_of(fitted))


def predicted_spots(fitted: Fitted, around: Around) -> Predicted | None:
    """NaN where the beam misses a face, or it is unknown where the fixture stood. None without a dual PSD."""
    rig = fitted.session.rig
    if rig.fixture is None or not rig.placements:
        return None
    half_m = rig.fixture.half_size_m
    values = {p.name: float(v) for p, v in zip(fitted.session.parameters, fitted.geometry, strict=True)}
    model = Predictor(rig, values, {}, ())

    def spots(q_rad: Floats, time_s: Floats) -> Floats:
        placement, first = around.at(time_s)
        out = np.full((len(q_rad), 4), np.nan)
        known = np.isin(placement, list(rig.placements)) & np.isin(first, ORDERS)
        if not np.any(known):
            return out
        with np.errstate(all="ignore"):  # a beam beside the faces may meet their planes anywhere, or nowhere
            out[known] = model.spots_m(q_rad[known], placement[known], first[known])
            out[~np.all(np.abs(out) < half_m, axis=1)] = np.nan
        return out

    return spots
