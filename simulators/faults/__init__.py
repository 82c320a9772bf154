"""Trouble that is injected into devices and lines on request of the side channel.

`fault` lists what there is, `injector` when it strikes, `line_faults` and `faulty_wire` what it does to the bytes. A
new kind is a name in `fault` and its effect in `line_faults` or in the state of the device.
"""
