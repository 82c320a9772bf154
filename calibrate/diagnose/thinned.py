"""Which samples of a long session the search works on: its cost grows with their number, what it can tell but slowly.

The model that is found is fitted to all of them afterwards.
"""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.diagnose.folds import units
from calibrate.diagnose.linearised import State

Ints = NDArray[np.intp]

MOST = 1800  # rows, 600 positions: an effect of a fifth of the noise is plain to see in so many


def thinned(state: State, rng: Generator) -> State:
    """The state itself, or fitted to samples drawn at random; repeats stay together."""
    samples = np.unique(state.rows.sample[state.rows.data])
    most = MOST * len(samples) // max(int(state.rows.data.sum()), 1)
    if len(samples) <= most:
        return state
    label = units(state.drivers)[samples]
    names, count = np.unique(label, return_counts=True)
    order = rng.permutation(len(names))
    kept = names[order[np.cumsum(count[order]) <= most]]
    return state.select(samples[np.isin(label, kept)]).refitted(())
