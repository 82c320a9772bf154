"""What is assumed of a rig whose file has no [tolerance], so that nothing states how far its drawing may be off.

Nobody's statement: it holds a fit where data see little, and is no source of a number (Parameter.assumed). Where the
file has a [tolerance], what that leaves out is as docs/formats.md states.
"""

from acquisition.recording.rig import Rig
from calibrate.model.arms.link_tolerance import LinkTolerance
from calibrate.model.optics.dual_psd import PairTolerance

# An uncalibrated arm misses by up to 2.6 mm and some mrad (arms/link_tolerance.py); a single link may hold several
# times that, since neighbours share it.
WIDE = LinkTolerance(5e-3, 1e-2, assumed=True)
# Cones without a bar hold no scale: least squares shrinks the arm, and the fit seems better. Machined links.
SCALELESS = LinkTolerance(0.5e-3, 2e-3, assumed=True)
# Of PSD 2 in PSD 1: two detectors screwed to a bracket, which is not machined to what they resolve.
PAIR = PairTolerance(1e-3, 5e-3, assumed=True)


def links_of(rig: Rig) -> LinkTolerance:
    """Of the arm's links, in a session of the dual PSD."""
    stated = rig.tolerance
    return WIDE if stated is None else LinkTolerance(stated.length_m, stated.angle_rad)


def pair_of(rig: Rig) -> PairTolerance | None:
    """Of PSD 2 in PSD 1; None where a [tolerance] leaves it out, by which it is exact."""
    stated = rig.tolerance
    if stated is None:
        return PAIR
    return None if stated.psd2_m is None or stated.psd2_rad is None else PairTolerance(stated.psd2_m, stated.psd2_rad)


def said_of(rig: Rig) -> str | None:
    """One line for a person about what a fit to spots of this rig assumes unasked; None where the rig states it."""
    if rig.tolerance is not None:
        return None
    links = f"links assumed to ± {1e3 * WIDE.length_sigma_m:g} mm, {1e3 * WIDE.angle_sigma_rad:g} mrad"
    pair = f"PSD 2 in PSD 1 to ± {1e3 * PAIR.length_sigma_m:g} mm, {1e3 * PAIR.angle_sigma_rad:g} mrad"
    return f"no [tolerance]: {links}, {pair}; what only this assumption determines gets no number"
