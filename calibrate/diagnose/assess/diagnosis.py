"""The result of a diagnosis: frozen records with the words of docs/formats.md, nothing without its uncertainty."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.assess.lack_of_fit import LackOfFit
from calibrate.diagnose.assess.stated_noise import NoiseFound
from calibrate.diagnose.assess.unseen_rows import Floor, HeldOutProof
from calibrate.diagnose.stages import Incomplete
from calibrate.diagnose.state.linearised import State
from calibrate.model.effects.term import Missing, Size

Floats = NDArray[np.float64]

UNKNOWN = "unknown"

# Of what is said of drawn sessions so many are right (`calibeam prove`, seeds 2001 to 2003, 180 sessions): names that
# have no alternative 136 of 144, of places of what has no name 28 of 32, of names beside what nothing explains 8 of 22.
NAMED, PLACED, NOT_FINAL = 0.95, 0.9, 0.4


class Verdict(Enum):
    """Words of docs/formats.md."""

    MISMATCH = "mismatch"
    CONSISTENT = "consistent"
    UNDECIDABLE = "undecidable"


@dataclass(frozen=True)
class Named:
    """Place, driver, form and physics of a cause."""

    where: str
    depends_on: tuple[str, ...]
    shape: str
    order: int | None
    physics: str

    def compared_with(self, other: "Named") -> str:
        """In words; with the driver where place and physics are those of the other name."""
        words = f"{self.physics} at {self.where}"
        if (self.physics, self.where) != (other.physics, other.where):
            return words
        return f"{words} by {' and '.join(self.depends_on)}"


@dataclass(frozen=True)
class RivalName:
    """Another cause that the data cannot separate from the finding."""

    name: Named
    confidence: float
    margin: float  # BIC by which the finding is better
    refitted: bool  # margin from a full refit, or linearised
    alike: bool = False  # at every recorded pose, whatever the sizes: more of such poses will not separate them
    plausible: bool = True  # False: it fits better, but only with a size that no machine has


@dataclass(frozen=True)
class Pulled:
    """Residual without the finding, divided by how the readings feel its port; the picture of a finding."""

    driver: str
    values: Floats  # (sample,)
    residual: Floats  # (sample,) in the unit of the port; nan where nothing is felt
    fitted: Floats  # (sample,)


@dataclass(frozen=True)
class Finding:
    """One cause, its size and its uncertainty."""

    name: Named
    parameters: Mapping[str, Size]
    share: float  # of the removable error variance
    confidence: float
    p: float  # family-wise, of nothing at all looking like this
    gain: float  # of BIC when taken out and everything else refitted
    predicts: float  # squares that it saves on rows held out, in variances, less one standard error
    says: str
    rivals: tuple[RivalName, ...]
    pulled: Pulled | None
    variant: str = ""  # of its term: which station or cone of several

    def weakened(self, share: float) -> "Finding":
        """As sure by a share: what its name loses goes to no name, hence its alternatives lose as much."""
        less = tuple(replace(r, confidence=share * r.confidence) for r in self.rivals)
        return replace(self, confidence=share * self.confidence, rivals=less)


@dataclass(frozen=True)
class Rejected:
    """A cause that was tested and is not there."""

    name: Named
    gain: float  # of BIC, best of its kind in the final model
    why: str


@dataclass(frozen=True)
class Unexplained:
    """Structure without a name."""

    where: str
    depends_on: tuple[str, ...]
    share: float  # of the residual's variance
    p: float
    why: str


@dataclass(frozen=True)
class Diagnosis:
    """Everything that may be reported of a session."""

    verdict: Verdict
    findings: tuple[Finding, ...]
    unexplained: tuple[Unexplained, ...]
    proofs: tuple[HeldOutProof, ...]
    floors: tuple[Floor, ...]
    lack_of_fit: LackOfFit | None
    noise_wanders: bool
    rejected: tuple[Rejected, ...]
    invisible: tuple[Named, ...]
    missing: tuple[Missing, ...]
    next: tuple[str, ...]
    model: State  # geometry, and the terms behind the findings
    incomplete: tuple[Incomplete, ...] = ()  # stages without a result
    noise: tuple[NoiseFound, ...] = ()  # beside what the rig file states of it
