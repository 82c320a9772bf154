"""What every verdict is made of: a degree of trust, reasons for care, advice; and the thresholds that lead to them."""

from dataclasses import dataclass
from enum import Enum

UNLIKELY = 0.01  # lack of fit: the usual level (Draper, Smith, Applied Regression Analysis, 1998, ch. 2.1)
WORSE_UNSEEN = 1.5  # error on unseen poses over its own uncertainty; of a healthy fit near 1
NOISIER = 3.0  # found over believed; believed noise is often wrong by this much, beyond it something is broken
AGAIN = "Measure again, with more and more different poses."

UNCHECKED = "There are as many unknowns as readings, or nearly so: any arm would fit, and nothing checks the result."
MORE_POSES = "Measure more poses: at least 15, better 50, all over the workspace."

Doubt = tuple[str, str]  # what speaks against trust, and what to do about it


class Trust(Enum):
    """How far a result may be used, on the one scale of all pages, files and messages."""

    GOOD = "yes"
    CARE = "with care"
    NONE = "no"

    @property
    def css(self) -> str:
        """The page's class for it."""
        return {Trust.GOOD: "good", Trust.CARE: "care", Trust.NONE: "bad"}[self]


@dataclass(frozen=True)
class Verdict:
    """One sentence, every reason for care, and what to do."""

    trust: Trust
    sentence: str
    reasons: tuple[str, ...]
    advice: tuple[str, ...] = ()  # what to do about them
