"""What to measure next where a cause has rivals: other poses, a change of temperature, or a second instrument."""

from collections.abc import Sequence

from calibrate.diagnose.diagnosis import Finding, Named, RivalName
from calibrate.diagnose.drifts import parted_by_time

POSES = "measure poses that separate them (calibeam diagnose --plan-out)"
# Temperature follows time unless the arm is cooled and warmed again (mismatch catalogue, confusable by nature).
COOLED = "no pose tells them apart; measure on while the arm is cooled and warmed again"
WITNESS = "alike at every pose to this instrument; watch either with a second one, or measure fixed marks again"


def to_measure(findings: Sequence[Finding]) -> tuple[str, ...]:
    """One sentence for each finding and remedy."""
    out: list[str] = []
    for finding in findings:
        for remedy in (POSES, COOLED, WITNESS):
            mine = [r.name for r in finding.rivals if _remedy(finding.name, r) == remedy]
            if mine:
                others = ", ".join(dict.fromkeys(name.beside(finding.name) for name in mine))
                out.append(f"{finding.name.physics} at {finding.name.where} could also be {others}: {remedy}")
    return tuple(out)


def _remedy(name: Named, rival: RivalName) -> str:
    if rival.alike:
        return WITNESS
    return COOLED if parted_by_time(name, rival.name) else POSES
