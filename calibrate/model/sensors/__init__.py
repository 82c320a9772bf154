"""Instruments: one file an entry, which owns its name, columns, unit, prediction, derivative and gross-error check."""
