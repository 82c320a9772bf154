"""An exciting motion before it is run: what it would show, joint by joint, and how near it comes to limits."""

import math
from typing import TYPE_CHECKING

import numpy as np

from calibeam.console import Console
from calibeam.printing.tables import plain_table
from calibrate.quantities import DASH, counted, significant

if TYPE_CHECKING:
    from calibrate.excitation import Excitation

COLUMNS = (
    ("dry friction, Nm", "friction_nm"),
    ("viscous, Nm s/rad", "friction_nms_per_rad"),
    ("rotor, kg m²", "rotor_kg_m2"),
    ("spring, Nm/rad", "stiffness_nm_per_rad"),
)


def print_excitation(console: Console, made: "Excitation", *, noise_given: bool) -> None:
    """Sigmas, then limits."""
    plan, found = made.plan, made.information
    console.print(
        f"{plan.rig}: {counted(plan.repeats, 'repeat')} of {plan.length_s:g} s, begins and ends at rest; the best of "
        f"{made.drawn} drawn motions, improved; its sigmas are {made.gain:.1f} times smaller than those of the middle "
        "one",
        markup=False,
        highlight=False,
    )
    table = plain_table("predicted uncertainty (1 sigma) of the torques", "joint", *(title for title, _ in COLUMNS))
    for joint in range(1, len(plan.joint) + 1):
        row = (_shown(found.sigma.get((f"joint{joint}.torque", name))) for _, name in COLUMNS)
        table.add_row(str(joint), *row)
    console.print(table)
    lean = " and ".join(_shown(found.sigma.get(("base.lean", f"lean_{axis}_rad")), 1e3) for axis in "xy")
    noise = "as given" if noise_given else f"assumed: {made.assumed_noise}"
    lines = [
        f"payload: {_shown(found.sigma.get(('tool.load', 'mass_kg')))} kg; lean of gravity about x and y: {lean} mrad",
        f"{DASH}: not determined by this motion with the masses that the rig file states",
        f"noise of a joint's torque at one moment: {', '.join(significant(one, 2) for one in found.noise_nm)} Nm "
        f"({noise})",
    ]
    console.print("\n".join(lines), markup=False, highlight=False)
    table = plain_table("nearest to limits", "joint", "range left, °", "speed", "acceleration", "expected torque, Nm")
    for i in range(len(plan.joint)):
        shares = (f"{100.0 * one[i]:.0f} %" for one in (made.speed_share, made.acceleration_share))
        peak = significant(float(found.peak_nm[i]), 2) if found.peak_nm[i] > 0.0 else DASH
        table.add_row(str(i + 1), f"{np.degrees(made.room_rad[i]):.0f}", *shares, peak)
    console.print(table)


def _shown(sigma: float | None, factor: float = 1.0) -> str:
    return DASH if sigma is None or not math.isfinite(sigma) else significant(factor * sigma, 2)
