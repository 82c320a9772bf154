"""The PSD box: eight photocurrents at a time over USB-serial. Frames with CRC (`codec`), what they carry (`messages`),
the device with its clock (`device`).
"""
