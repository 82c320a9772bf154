"""The chapter on proof of a dual-PSD session: unseen rows by every split, and the error anywhere in the workspace."""

from calibrate.identification.evidence_record import EvidenceFields
from calibrate.report.elements import Html, section
from calibrate.report.free_space_table import free_space
from calibrate.report.unseen_table import unseen_rows

TITLE = "Proof"


def proofs(found: EvidenceFields) -> Html:
    """From the same fit, by the way of all instruments."""
    lead = "An error on rows that the fit has not seen is what to expect at work, of both spots together."
    return section(
        "proofs", TITLE, lead, *unseen_rows(found["proofs"], found["unproven"]), *free_space(found["free_space"])
    )
