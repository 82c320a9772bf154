"""Drivers at poses that were not measured: joints given, all else as at measured poses drawn at random.

Many terms scale their drivers by what the session holds, so new poses stand behind the measured ones, and a term is
asked for both: coefficients are then those that give the measured poses what they had.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.linearised import Accepted
from calibrate.effects.drivers import Drivers, Readout

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

SAME = 1e-6  # of a term's size: what rounding may leave between the two sets of coefficients


def extended(drivers: Drivers, q_rad: Floats, frames: Floats, like: Ints) -> Drivers:
    """With poses (new, joint) and their frames behind; of everything else the new ones are like measured poses."""
    order = np.concatenate([np.arange(len(drivers.q_rad)), like])

    def more(values: Floats | None) -> Floats | None:
        return None if values is None else values[order]

    return replace(
        drivers,
        q_rad=np.concatenate([drivers.q_rad, q_rad]),
        frames=np.concatenate([drivers.frames, frames]),
        t_s=drivers.t_s[order],
        readouts={name: _more_readout(readout, order) for name, readout in drivers.readouts.items()},
        approach=more(drivers.approach),
        last_move_rad=drivers.last_move_rad[order],
        qd_rad_s=more(drivers.qd_rad_s),
        cmd_minus_q_rad=more(drivers.cmd_minus_q_rad),
        temperatures_degC={place: values[order] for place, values in drivers.temperatures_degC.items()},
        payload_kg=more(drivers.payload_kg),
        payload_com_m=more(drivers.payload_com_m),
        psd_sum_v=more(drivers.psd_sum_v),
        extra={name: values[order] for name, values in drivers.extra.items()},
        repeat=None if drivers.repeat is None else drivers.repeat[order],
    )


def carried_over(accepted: Accepted, old: Drivers, new: Drivers) -> Floats | None:
    """(new pose, width, coefficient) what the coefficients add at the poses behind those of `old`; None: not told."""
    was, now = accepted.term.basis(old, accepted.inner), accepted.term.basis(new, accepted.inner)
    n, m = len(was), was.shape[-1]
    if now.shape[-1] != m or len(now) != len(new.q_rad):  # a term that knows the measured poses only
        return None
    here = now[:n].reshape(-1, m)
    same, *_ = np.linalg.lstsq(here, was.reshape(-1, m), rcond=None)
    if np.linalg.norm(here @ same - was.reshape(-1, m)) > SAME * np.linalg.norm(was):
        return None
    return now[n:] @ same


def _more_readout(readout: Readout, order: Ints) -> Readout:
    return replace(
        readout,
        predicted=readout.predicted[order],
        seen=readout.seen[order],
        incidence_rad=None if readout.incidence_rad is None else readout.incidence_rad[order],
        lean=None if readout.lean is None else readout.lean[order],
        first_psd=None if readout.first_psd is None else readout.first_psd[order],
        place=None if readout.place is None else readout.place[order],
    )
