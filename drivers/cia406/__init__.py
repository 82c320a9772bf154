"""Joint encoders on CANopen by CiA 406: objects, frames and how counts become angles (`codec`), what a node is set to
and how it is checked (`configuration`, `health`), one reading of all nodes per SYNC (`cycle`), the device itself
(`device`).
"""
