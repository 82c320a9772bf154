"""Several names at one place of a machine that is sound elsewhere: pieces of one law that nobody has listed.

Sines of a joint's angle and its torque build up any function of the pose, so a few of them that fit prove little.
Faults that have nothing to do with each other are spread over a machine; three of them at one joint and next to none
anywhere else are one cause.
"""

from collections.abc import Sequence

from scipy.stats import poisson

from calibrate.diagnose.linearised import Accepted

SEVERAL = 3  # two may share a joint
BY_CHANCE = 0.01  # that so many faults meet at one of the places
UNSEEN = 0.5  # of a fault, for those elsewhere that are too small to be found (Jeffreys' prior of a Poisson rate)


def pieces(accepted: Sequence[Accepted], places: int) -> list[tuple[int, ...]]:
    """Groups of accepted names at one port that are no names but one unknown cause; `places` where a fault could be."""
    found: dict[str, list[int]] = {}
    for i, a in enumerate(accepted):
        if not a.term.open and all(map(_of_pose, a.term.depends_on)):
            found.setdefault(a.term.port.where, []).append(i)
    names = sum(not a.term.open for a in accepted)
    return [tuple(group) for group in found.values() if _meet_too_often(len(group), names - len(group), places)]


def _meet_too_often(here: int, elsewhere: int, places: int) -> bool:
    """Whether so many names at one of the places are no chance, at the rate of all others."""
    rate = (elsewhere + UNSEEN) / max(places - 1, 1)
    return here >= SEVERAL and float(poisson.sf(here - 1, rate)) * places < BY_CHANCE


def _of_pose(driver: str) -> bool:
    return driver.startswith("gravity_torque") or (driver[0] == "q" and driver[1:].isdigit())
