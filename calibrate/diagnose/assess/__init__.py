"""How sure a diagnosis is: findings with their alternatives, what has no name, unseen rows, stated noise, detection
limits, and effects that these poses cannot separate.
"""

from calibrate.diagnose.assess.detection_limits import Isolability, Smallest, isolability, smallest_visible
from calibrate.diagnose.assess.diagnosis import Finding, Named, Verdict
from calibrate.diagnose.assess.findings import named
from calibrate.diagnose.assess.stated_noise import Statement
from calibrate.diagnose.assess.unseen_rows import proofs

__all__ = [
    "Finding",
    "Isolability",
    "Named",
    "Smallest",
    "Statement",
    "Verdict",
    "isolability",
    "named",
    "proofs",
    "smallest_visible",
]
