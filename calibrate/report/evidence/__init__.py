"""What a report shows, computed from model and recording alone, and the verdict that follows."""

from calibrate.report.evidence.model_tests import fit_end
from calibrate.report.evidence.session_evidence import SessionEvidence, session_evidence
from calibrate.report.evidence.session_verdict import session_verdict

__all__ = ["SessionEvidence", "fit_end", "session_evidence", "session_verdict"]
