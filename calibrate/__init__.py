"""Calibration and diagnosis of arms: pure computation on recordings.

Floors, from the bottom: model, fit, apply, diagnose, compare; design, error_simulation, verify, tool_axes and iso9283;
report. A floor imports only floors below it, and takes what it needs from the face of a package.
"""
