"""Files written by another convention: every known one is tried against the arm as drawn, and the winner is named.

A hypothesis wins where it alone brings the distance between arm and positions down to a fraction. A real arm lies a few
millimetres beside its drawing, a wrong convention decimetres, so the two are never mixed up. What the target would have
to move from where it is drawn counts too: half a turn of a wrist joint can look like a target on the other side.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from calibrate.blunders import coupling, degrees, mirror, offsets, signs
from calibrate.blunders.finding import Blunder
from calibrate.blunders.hypothesis import Hypothesis
from calibrate.blunders.rough_fit import rough_fit

Floats = NDArray[np.float64]

KNOWN = (degrees.hypotheses, signs.hypotheses, offsets.hypotheses, coupling.hypotheses, mirror.hypotheses)

GAIN = 4.0  # by which the distance must fall
RIVAL = 1.5  # times the winner's distance: as good an explanation
FEWEST_POSES = 12  # a frame and a target have nine unknowns
ENOUGH_POSES = 150  # more do not change which hypothesis wins
TRUST = 0.1  # of a drawn target: it may be 10 mm off where the positions are explained to 1 mm


def wrong_convention(
    flange: Callable[[Floats], Floats], q_rad: Floats, position_m: Floats, point_m: Floats | None
) -> Blunder | None:
    """The convention that explains the positions (pose, 3) when the one of the rig does not; None if it does.

    `flange` maps angles (pose, joint) to (pose, 4, 4) of the arm as drawn; `point_m` (3,) is the target as drawn, None
    where nobody says.
    """
    if len(q_rad) < FEWEST_POSES:
        return None
    some = np.unique(np.linspace(0, len(q_rad) - 1, ENOUGH_POSES).astype(np.intp))
    q, positions = q_rad[some], position_m[some]

    def strain_m(flanges: Floats, mirrored: bool = False) -> tuple[float, float]:
        """What is compared, and the distance alone, for a person."""
        found = rough_fit(flanges, positions, np.zeros(3) if point_m is None else point_m, mirrored=mirrored)
        moved = 0.0 if point_m is None else float(np.linalg.norm(found.point_m - point_m))
        return found.typical_m + TRUST * moved, found.typical_m

    as_written = strain_m(flange(q))
    tried = [(strain_m(flange(h.angles(q)), h.mirrored), h) for family in KNOWN for h in family(q.shape[1])]
    (best, best_m), _ = min(tried, key=lambda one: one[0])
    if not best * GAIN < as_written[0]:
        return None
    winners = [h for (strain, _), h in tried if strain <= RIVAL * best]
    return _named(winners, as_written[1], best_m)


def _named(winners: list[Hypothesis], as_written_m: float, best_m: float) -> Blunder:
    """The winner; others that explain the file as well are told in the same breath."""
    first = winners[0]
    others = "".join(f"; or {h.column}: {h.what}" for h in winners[1:])
    figures = f"(arm and positions agree to {1e3 * best_m:.2g} mm then, to {1e3 * as_written_m:.3g} mm as written)"
    if as_written_m < GAIN * best_m:
        figures = "(only then does the target sit where it is drawn)"
    return Blunder(first.kind, (), first.column, f"{first.what} {figures}{others}", first.remedy)
