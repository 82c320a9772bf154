"""Figures of a report: errors by joint and time, the rig, reflections, interactive scenes."""
