"""Gross errors of a file: wrong units, signs and tables, duplicated rows, rows that stand apart.

What one sensor can check in its own readings stands in the sensor (calibrate/model/checks/ has the words for it).
"""

from calibrate.fit.gross_errors.bad_rows import bad_rows

__all__ = ["bad_rows"]
