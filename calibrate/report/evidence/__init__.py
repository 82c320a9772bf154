"""What a report shows, computed from model and recording alone, and the verdict that follows."""

from calibrate.report.evidence.model_tests import fit_end
from calibrate.report.evidence.session_evidence import (
    SessionEvidence,
    noise_of,
    session_evidence,
    values_of,
    weighting_of,
)
from calibrate.report.evidence.session_verdict import session_verdict

__all__ = ["SessionEvidence", "fit_end", "noise_of", "session_evidence", "session_verdict", "values_of", "weighting_of"]
