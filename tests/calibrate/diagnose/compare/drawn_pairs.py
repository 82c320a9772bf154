"""Two sessions of one plan by the concealed bench: an arm that is off, with mechanisms, and a simulation of it."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from acquisition.recording import read
from simulators.arm.drawing import fixed_parts
from simulators.conceal.case import add_noise, conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.observe import observe
from simulators.conceal.wanted import Wanted
from simulators.defects.defect import Defect

FIELDS = {"length": "a_m", "offset": "d_m", "twist": "alpha_rad"}


@dataclass(frozen=True)
class Made:
    """One of the two. `off`: constants as model.json names them, "joint3.zero", "link2.length"."""

    off: dict[str, float]
    defects: tuple[Defect, ...] = ()
    exact: bool = False


def case_of(**wanted):
    """A session whose rig file is in a notation with rows; its mechanisms are there to be taken."""
    return conceal(Wanted(**wanted))


def written(folder: Path, case, made: Made, seed: int) -> Path:
    """The session folder of the case's plan, with the nominal arm but for what is `made` of it."""
    drawing, believed = case.drawn.drawing, case.drawn.believed
    rows, zero_rad = list(drawing.rows), np.zeros(drawing.n_joints)
    for name, by in made.off.items():
        owner, _, what = name.partition(".")
        number = int(owner[-1]) - 1
        if what == "zero":
            zero_rad[number] = by
        else:
            row = (
                number + 1 if drawing.model == "mdh" and what != "offset" else number
            )  # Craig's a and alpha come first
            rows[row] = replace(rows[row], **{FIELDS[what]: getattr(rows[row], FIELDS[what]) + by})
    arm = replace(believed.arm, fixed=fixed_parts(replace(drawing, rows=tuple(rows))), zero_rad=zero_rad)
    true = replace(believed, arm=arm)
    exact = observe(true, case.table.scene, made.defects, case.posture_rad)
    sigma_m = 0.0 if made.exact else case.sigma_m
    reading_rad, values_m = add_noise(case.wanted, true, exact, sigma_m, np.random.default_rng(seed))
    other = replace(
        case,
        drawn=replace(case.drawn, true=true),
        exact=exact,
        reading_rad=reading_rad,
        values_m=values_m,
        rng=np.random.default_rng(seed + 1),
    )
    write_case(other, folder)
    return folder / "recording"


def pair_of(folder: Path, case, measured: Made, simulated: Made):
    """Both, read back."""
    made = (written(folder / "m", case, measured, 100), written(folder / "s", case, simulated, 200))
    return tuple(read(one) for one in made)
