"""A robot controller behind Modbus/TCP: its registers as the rig file maps them (`register_map`), joints read
(`reader`) and moved (`arm`) over one connection (`line`).
"""
