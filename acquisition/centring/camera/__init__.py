"""The camera beside the laser: its lens and mount (`model`), the printed board in its view (`board`), and how both
are measured once (`calibration`, `measuring`).
"""
