"""Joint encoders on CAN as a DBC file describes them: frames and signals (`description`), rows of all joints
(`device`).
"""
