"""The chapter on proof of a dual-PSD session: unseen rows by every split, and the error anywhere in the workspace."""

from collections.abc import Iterator, Sequence

from calibrate.identification.evidence_record import EvidenceFields
from calibrate.report.elements import Html, bullets, section, tag
from calibrate.report.free_space_table import free_space
from calibrate.report.observability_table import observability
from calibrate.report.unseen_table import unseen_rows

TITLE = "Proof"


def proofs(found: EvidenceFields, alarms: Sequence[str]) -> Html:
    """From the same fit, by the way of all instruments; `alarms` as model.json has them."""
    lead = "An error on rows that the fit has not seen is what to expect at work, of both spots together."
    return section(
        "proofs",
        TITLE,
        lead,
        *_alarms(alarms),
        *unseen_rows(found["proofs"], found["unproven"]),
        *free_space(found["free_space"]),
        *([] if found["observability"] is None else observability(found["observability"])),
    )


def _alarms(alarms: Sequence[str]) -> Iterator[Html]:
    if alarms:
        yield tag("div", tag("strong", "Read before the numbers"), bullets(alarms), cls="verdict care")
    else:
        yield tag("p", "Chi-square against the noise as stated raises no alarm, and neither do repeated poses.")
