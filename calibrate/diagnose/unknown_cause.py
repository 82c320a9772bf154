"""What is said of all open terms at one port: a place, drivers, and how much of it these poses show.

A curve's coefficients are shared out between it, its neighbours and geometry as priors please; their size is no size of
anything. What only the curve explains is one: felt at the readings, divided by how they feel the port.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.curve import UNKNOWN, unit_of
from calibrate.diagnose.diagnosis import Finding, Named
from calibrate.diagnose.linearised import Accepted
from calibrate.diagnose.port_process import lever
from calibrate.diagnose.pulled_back import pulled_back
from calibrate.diagnose.score import Removed, gain_of, removed
from calibrate.diagnose.searching import Search
from calibrate.effects.term import Size
from calibrate.effects.words import plain

Floats = NDArray[np.float64]


def unknown_cause(at: Search, group: Sequence[int], predicts: Floats) -> Finding:
    """One finding for the accepted open terms `group`, all of one port, the largest one first in the picture.

    `predicts` (term,) as calibrate/diagnose/doubt.py gives it. The share is a square, not divided by that of
    all findings.
    """
    bench = at.bench
    gone = removed(bench.state, bench.sight, tuple(group))
    mine = [bench.state.accepted[i] for i in sorted(group, key=lambda i: -bench.gone[i].squares)]
    p = max(at.p.get(a.term.key, 0.0) for a in mine)
    name, size = _size(bench, mine[0], gone)
    where, drivers = mine[0].term.port.where, tuple(dict.fromkeys(d for a in mine for d in a.term.depends_on))
    return Finding(
        name=Named(where, drivers, mine[0].term.shape.value, None, UNKNOWN),
        parameters={name: size},
        share=gone.squares,
        confidence=1.0 - p,
        p=p,
        gain=gain_of(gone, bench.sight),
        predicts=float(sum(predicts[i] for i in group)),
        says=f"Unknown cause at {where}, depends on {' and '.join(drivers)}: shows as {plain(name, size)} rms",
        rivals=(),
        pulled=pulled_back(bench, mine[0]),
    )


def _size(bench: Bench, largest: Accepted, gone: Removed) -> tuple[str, Size]:
    """Root mean square at the port that only these terms explain, noise taken out, its name with its unit."""
    port, component = largest.term.port, _component(bench, largest)
    felt = float(np.linalg.norm(lever(bench, port, component)))
    left = max(bench.sight.rss / max(bench.sight.data, 1), 1e-300)
    shown = float(np.sqrt(max(gone.squares - len(gone.part) * left, 0.0)))
    # Each of the directions has the noise of a row: so has the length of them all, to first order.
    return f"rms_{unit_of(port, component)}", Size(shown / max(felt, 1e-300), float(np.sqrt(left)) / max(felt, 1e-300))


def _component(bench: Bench, accepted: Accepted) -> int:
    """Of the port, the one through which the readings feel the term most."""
    amount = accepted.term.amount(bench.state.drivers, accepted.coefficients, accepted.inner)
    moved = np.flatnonzero(np.any(amount != 0.0, axis=0))
    sample = np.maximum(bench.state.rows.sample, 0)
    felt = [float(np.linalg.norm(lever(bench, accepted.term.port, int(c)) * amount[sample, c])) for c in moved]
    return int(moved[int(np.argmax(felt))]) if len(moved) else 0
