"""Trouble that is injected into devices and lines on request of the side channel.

`device_faults` lists what there is and what it does to devices and bytes, `injector` when it strikes and which line
carries it. A new kind is a name in `device_faults`, and its effect there or in the state of the device.
"""
