"""How much a row counts. Sizes of noise by source (REML), rows as sources of noise, what instruments share with second
encoders, robust scale. Weights of rows are made of these in calibrate/fit/weighting.py.
"""

from calibrate.fit.noise.scatter import (
    NU,
    Scatter,
    SharedScatter,
    levers_of,
    likelihood_of,
    scatter_of,
    shares_found,
    sigma_about_zero,
    witness_of,
)
from calibrate.fit.noise.variance import SEPARABLE, VarianceFactors, as_assumed

__all__ = [
    "NU",
    "SEPARABLE",
    "Scatter",
    "SharedScatter",
    "VarianceFactors",
    "as_assumed",
    "levers_of",
    "likelihood_of",
    "scatter_of",
    "shares_found",
    "sigma_about_zero",
    "witness_of",
]
