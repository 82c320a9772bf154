"""Acceptance tests of measuring arms by standards of known length: figures of ISO 10360-12 and ASME B89.4.22."""

from calibrate.verify.measured_lengths import Figure, Judgement
from calibrate.verify.verify import Verification, verification_file, verify

__all__ = ["Figure", "Judgement", "Verification", "verification_file", "verify"]
