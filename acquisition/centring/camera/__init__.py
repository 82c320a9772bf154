"""The camera beside the laser: its lens and mount (`model`), the printed board that it looks at (`board`), and how both
are measured once (`calibration`, `measuring`).
"""
