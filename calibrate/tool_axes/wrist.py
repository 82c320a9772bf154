"""Which two rotations place the flange, and what to say where they are missing."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.fit import Status
from calibrate.tool_axes.circle import Circle
from calibrate.tool_axes.segments import FEWEST, SHORTEST_RAD, STILL_RAD, Segment, too_short

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class AxisFound:
    """One joint's axis in the device's frame."""

    segment: Segment
    circle: Circle


def wrist(axes: Sequence[AxisFound], q_rad: Floats, row_of: Callable[[int], int]) -> tuple[AxisFound, AxisFound]:
    """Rotations of the last two joints, taken with the joints before them at the same readings.

    `row_of` says which row of the file, from 1, a row of `q_rad` is. DataError where they are missing or bad.
    """
    n = q_rad.shape[1]
    apart: list[str] = []
    for last in (a for a in axes if a.segment.joint == n):
        for before in (a for a in axes if a.segment.joint == n - 1):
            between = np.abs(last.segment.held(q_rad) - before.segment.held(q_rad))[: n - 2]
            if np.all(between <= STILL_RAD):
                _refuse_bad(before, row_of)
                _refuse_bad(last, row_of)
                return before, last
            joint = int(np.argmax(between)) + 1
            apart.append(
                f"joint {joint} stands {np.degrees(between[joint - 1]):.2g} deg apart between "
                f"{rows_said(before.segment, row_of)} and {rows_said(last.segment, row_of)}"
            )
    raise DataError(
        f"tool by single axes: rotations of joint {n - 1} alone and {n} alone are needed, joints 1 to {n - 2} at "
        f"the same readings; {_what_there_is(axes, q_rad, row_of, apart)}"
    )


def rows_said(segment: Segment, row_of: Callable[[int], int]) -> str:
    """'rows 12-26'."""
    return f"rows {row_of(int(segment.rows[0]))}-{row_of(int(segment.rows[-1]))}"


def _what_there_is(axes: Sequence[AxisFound], q_rad: Floats, row_of: Callable[[int], int], apart: Sequence[str]) -> str:
    """What was found instead, and which of it nearly would have done."""
    if apart:
        return "; ".join(apart)
    turned = ", ".join(f"{a.segment.joint} ({rows_said(a.segment, row_of)})" for a in axes) or "none"
    n = q_rad.shape[1]
    short = [
        f"joint {s.joint} alone turns only {np.degrees(s.span_rad(q_rad)):.3g} deg in {len(s.rows)} rows "
        f"({rows_said(s, row_of)})"
        for s in too_short(q_rad)
        if s.joint in (n - 1, n)
    ]
    needed = f"; {np.degrees(SHORTEST_RAD):.0f} deg and {FEWEST} rows are needed" if short else ""
    return "; ".join([f"found single rotations of joint {turned}", *short]) + needed


def _refuse_bad(axis: AxisFound, row_of: Callable[[int], int]) -> None:
    if axis.circle.status is not Status.CONVERGED:
        raise DataError(
            f"circle of joint {axis.segment.joint}, {rows_said(axis.segment, row_of)}: {axis.circle.status.value}; "
            "turn farther"
        )
