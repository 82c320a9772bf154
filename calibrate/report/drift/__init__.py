"""Two calibrations of one robot beside each other: what changed, with its significance."""

from calibrate.report.drift.two_calibrations import Calibration, drawn_values, drift_of

__all__ = ["Calibration", "drawn_values", "drift_of"]
