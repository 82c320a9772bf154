"""The picture of a finding: residual pulled back to where it arises, against what it depends on, with the curve."""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from calibrate.diagnose.schema import CurveRecord
from calibrate.report.elements import Html
from calibrate.report.error_figures import thinned
from calibrate.report.svg import drawn
from calibrate.report.tones import Tone

Floats = NDArray[np.float64]

SHOWN = (0.5, 99.5)  # percentiles of the residual on the axis: where a port is hardly felt, points fly far
ROOM = 1.6  # times what is shown
LINE_LEVELS = 6  # different driver values: below, the curve is a few levels and drawn as points


def pulled_figure(name: str, curve: CurveRecord, *, single: bool) -> Html:
    """`single`: the cause depends on the drawn driver alone, so that its curve is a line."""
    says = f"residual without this cause, pulled back to its place, against {curve.driver}, with the fitted curve"
    return drawn(f"pulled-{name}", says, 4.8, 3.3, lambda figure: _paint(figure, curve, single=single))


def _paint(figure: Figure, curve: CurveRecord, *, single: bool) -> None:
    axes = figure.add_subplot()
    x, y, fitted = (np.array(values, dtype=np.float64) for values in (curve.values, curve.residual, curve.fitted))
    scale, unit = _unit(curve.unit, float(np.nanmax(np.abs(fitted), initial=0.0)))
    turn, axis = _axis(curve.driver, x)
    shown = thinned(len(x))
    axes.axhline(0.0, color=Tone.SOFT.value, lw=0.8)
    axes.plot(
        turn * x[shown], scale * y[shown], "o", ms=2.6, mew=0, color=Tone.PLACE_1.value, alpha=0.5, label="samples"
    )
    order = np.argsort(x, kind="stable")
    style = "-" if single and len(np.unique(x)) >= LINE_LEVELS and _is_curve(x[order], fitted[order]) else "o"
    axes.plot(
        turn * x[order], scale * fitted[order], style, ms=3.0, mew=0, lw=2.0, color=Tone.BEAM.value, label="fitted"
    )
    reach = _reach(scale * y, scale * fitted)
    axes.set(xlabel=axis, ylabel=f"residual there ({unit})", ylim=(-reach, reach))
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, 1.12), ncols=2, borderaxespad=0.0)


def _is_curve(x: Floats, fitted: Floats) -> bool:
    """Whether neighbours have nearly the same value: a hidden driver would make it a cloud."""
    span = float(np.ptp(fitted))
    return span > 0.0 and float(np.median(np.abs(np.diff(fitted)))) < 0.1 * span and len(x) > 1


def _reach(y: Floats, fitted: Floats) -> float:
    known = y[np.isfinite(y)]
    most = float(np.max(np.abs(fitted), initial=0.0))
    if len(known):
        most = max(most, float(np.max(np.abs(np.percentile(known, SHOWN)))) / ROOM)
    return ROOM * max(most, 1e-12)


def _unit(unit: str, reach: float) -> tuple[float, str]:
    sizes = {"m": ((1e3, "mm"), (1e6, "µm")), "rad": ((1e3, "mrad"), (1e6, "µrad"))}[unit]
    return sizes[0] if reach * sizes[0][0] >= 1.0 else sizes[1]


def _axis(driver: str, x: Floats) -> tuple[float, str]:
    """Factor and label."""
    stem = driver.rstrip("0123456789")
    number = driver[len(stem) :]
    known = {
        "q": (np.degrees(1.0), f"joint {number} (°)"),
        "t": (1.0 / 60.0, "time (min)"),
        "gravity_torque": (1.0, f"gravity torque on joint {number} (Nm)"),
        "overturning_moment": (1.0, "overturning moment (Nm)"),
        "last_move": (np.degrees(1.0), f"last move of joint {number} (°)"),
        "qd": (np.degrees(1.0), f"speed of joint {number} (°/s)"),
        "cmd_minus_q": (np.degrees(1.0), f"command less reading, joint {number} (°)"),
        "approach": (1.0, f"way joint {number} came"),
        "spot": (1e3, f"distance of the spot from the middle of PSD {number} (mm)"),
        "incidence": (np.degrees(1.0), f"angle of the beam on PSD {number} (°)"),
        "payload": (1.0, "payload (kg)"),
        "reading": (1.0, "reading (m)"),
    }
    if stem.startswith("temp_"):
        return 1.0, f"temperature, {driver.removeprefix('temp_')} (°C)"
    return known.get(stem, (1.0, driver))
