"""What the samples of a recording were exposed to, as the simulators take it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.samples import SEAT
from calibrate.model.effects.conditions import conditions_of, temperatures_of
from calibrate.model.model_file import ModelFile
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
