"""What is assumed of an arm's links before any data: held nominal, free, or drawn to a tolerance."""

import math
from dataclasses import dataclass

from calibrate.model.parameters import Parameter

ZERO_PLAUSIBLE_RAD = 0.0785  # 4.5 deg: the bound of the point-constraint paper (Deng, Ding, Zhang 2019)
# What an uncalibrated arm of 1 m reach misses: 0.65 mm and 2.8 mrad (IRB 1600), to 2.6 mm (UR5); Slamani, Nubiola,
# Bonev, Industrial Robot 39(1), 2012, and the UR5 tracker data. It scales columns and is no prior.
LINK_PLAUSIBLE = 1e-3  # m, rad


@dataclass(frozen=True)
class LinkTolerance:
    """One sigma about the drawing; 0 holds the links nominal, infinity leaves them free without an opinion."""

    length_sigma_m: float
    angle_sigma_rad: float
    assumed: bool = False  # nobody's statement (Parameter.assumed)

    def __post_init__(self) -> None:
        if not (self.length_sigma_m >= 0.0 and self.angle_sigma_rad >= 0.0):
            raise ValueError(
                f"link tolerance {self.length_sigma_m} m, {self.angle_sigma_rad} rad: a sigma is not negative"
            )


HELD_NOMINAL = LinkTolerance(0.0, 0.0)
FREE = LinkTolerance(math.inf, math.inf)


def zero_parameter(joint: int) -> Parameter:
    """The zero of a joint, free and without prior."""
    return Parameter(f"joint{joint}.zero", "rad", ZERO_PLAUSIBLE_RAD)


def link_length(name: str, tolerance: LinkTolerance) -> Parameter:
    """A correction (m) to a drawn length."""
    return _correction(name, "m", tolerance.length_sigma_m, tolerance.assumed)


def link_angle(name: str, tolerance: LinkTolerance, *, own: bool = True) -> Parameter:
    """A correction (rad) to a drawn angle; held where it is not a motion of its own but another one's second name."""
    return _correction(name, "rad", tolerance.angle_sigma_rad if own else 0.0, tolerance.assumed)


def _correction(name: str, unit: str, sigma: float, assumed: bool) -> Parameter:
    if sigma == 0.0:
        return Parameter(name, unit, LINK_PLAUSIBLE, free=False)
    if math.isinf(sigma):
        return Parameter(name, unit, LINK_PLAUSIBLE)
    return Parameter(name, unit, sigma, prior=sigma, assumed=assumed)
