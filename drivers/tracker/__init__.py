"""Instruments that print positions line by line: laser trackers' exporters, cameras' loggers; ASCII columns or JSON."""
