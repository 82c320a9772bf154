"""A comparison in words: one sentence for who decides, and the sizes of changes as a person says them."""

from math import degrees

import numpy as np

from calibrate.report.drift.parameters import Change
from calibrate.report.drift.two_calibrations import Drift
from calibrate.report.not_determined import in_plain_words
from calibrate.report.quantities import decimals_of, fixed, length, significant

TOLD = 3  # changes in the sentence; all of them stand in the table


def sentence(drift: Drift) -> str:
    """What moved since, by how much and how surely, and what it does to the tool."""
    since, found = f"Since {drift.then.label}", drift.compared
    if not found.changes:
        return f"{since}: no comparison, because no parameter of the arm is determined both then and now."
    if not drift.found:
        largest = max(found.changes, key=lambda c: c.sigmas)
        most = f" (most of all {in_plain_words(largest.name)}, {significant(largest.sigmas, 2)} sigma)"
        return (
            f"{since}: no drift shows. None of {len(found.changes)} parameters changed by more than chance gives"
            f"{most if largest.sigmas > 0.0 else ''}{_blind(drift)}."
        )
    clear = found.significant
    told = [moved(change) for change in clear[:TOLD]]
    if len(clear) > TOLD:
        more = len(clear) - TOLD
        told.append(f"{more} more parameter{'s' if more > 1 else ''} changed")
    if not told and found.together is not None:
        told = [f"the arm changed, but no single parameter shows where (p =  {significant(found.together.p, 2)})"]
    return f"{since}: {', '.join(told)}{_tool(drift)}."


def moved(change: Change) -> str:
    """'joint 3 moved by 0.021° (7 sigma)'."""
    owner, _, what = change.name.partition(".")
    times = f"({significant(change.sigmas, 2)} sigma)"
    if what == "zero":
        return f"joint {owner.removeprefix('joint')} moved by {size(change)} {times}"
    return f"{in_plain_words(change.name)} changed by {size(change)} {times}"


def size(change: Change) -> str:
    """Degrees for angles, a fitting unit for lengths, with the digits that the doubt leaves."""
    if change.unit == "rad":
        return f"{fixed(abs(degrees(change.change)), decimals_of(degrees(change.sigma)))}°"
    return length(abs(change.change))


def _blind(drift: Drift) -> str:
    """How much of a change would not have been seen."""
    if drift.tool is None or drift.room is None:
        return ""
    sigma_m = float(np.sqrt(np.mean(drift.tool.sigma_m[drift.room.supported] ** 2)))
    return f"; a change of the tool is determined to {length(sigma_m, 2)}, one sigma"


def _tool(drift: Drift) -> str:
    return "" if drift.tool is None else f"; tool error up to {length(drift.tool.largest_m, 2)}"
