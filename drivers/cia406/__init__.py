"""Joint encoders on CANopen by CiA 406: objects and frames (`codec`), what a node is set to and how it is checked
(`configuration`, `health`), counts to angles (`angle`), one reading of all nodes per SYNC (`cycle`), the device itself
(`device`).
"""
