"""What a learner without ports is given: every number of a sample that the diagnosis has, too. None is the answer."""

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.fitted import Fitted

Floats = NDArray[np.float64]


def features(state: Fitted) -> tuple[Floats, tuple[str, ...]]:
    """(sample, feature) of mean zero and spread one, and their names. Columns that never change are left out."""
    d = state.drivers
    joints = range(1, d.n_joints + 1)
    blocks: list[tuple[list[str], Floats]] = [
        ([f"sin(q{j})" for j in joints], np.sin(d.q_rad)),
        ([f"cos(q{j})" for j in joints], np.cos(d.q_rad)),
        ([f"last_move{j}" for j in joints], d.last_move_rad),
        (["t"], d.t_s[:, None]),
    ]
    for name, values in (("approach", d.approach), ("qd", d.qd_rad_s), ("cmd_minus_q", d.cmd_minus_q_rad)):
        if values is not None:
            blocks.append(([f"{name}{j}" for j in joints], values))
    if d.payload_kg is not None:
        blocks.append((["payload"], d.payload_kg[:, None]))
    if d.psd_sum_v is not None:
        blocks.append((["psd1_sum", "psd2_sum"], d.psd_sum_v))
    blocks += [([f"temp_{where}"], values[:, None]) for where, values in d.temperatures_degC.items()]
    blocks += [([name], values[:, None]) for name, values in d.extra.items()]
    for name, readout in d.readouts.items():
        k = readout.predicted.shape[1]
        blocks.append(([f"{name} reading {i + 1}" for i in range(k)], np.nan_to_num(readout.predicted)))
        if readout.place is not None:
            blocks.append(([f"{name} place"], readout.place[:, None].astype(float)))
    names = [word for words, _ in blocks for word in words]
    table = np.concatenate([values for _, values in blocks], axis=1)
    spread = table.std(axis=0)
    kept = spread > 0.0
    scaled = (table[:, kept] - table[:, kept].mean(axis=0)) / spread[kept]
    return scaled, tuple(name for name, keep in zip(names, kept, strict=True) if keep)
