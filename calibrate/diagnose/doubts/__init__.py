"""How sure a diagnosis is: findings with their alternatives, what has no name, unseen rows, stated noise, detection
limits, and effects that these poses cannot separate.
"""

from calibrate.diagnose.doubts.detection_limits import Isolability, Smallest, isolability, smallest_visible
from calibrate.diagnose.doubts.diagnosis import Finding, Named, Verdict
from calibrate.diagnose.doubts.findings import named
from calibrate.diagnose.doubts.stated_noise import Statement

__all__ = [
    "Finding",
    "Isolability",
    "Named",
    "Smallest",
    "Statement",
    "Verdict",
    "isolability",
    "named",
    "smallest_visible",
]
