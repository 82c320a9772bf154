"""Devices on real wires as acquisition sees them: a reader thread each (`streams`), a device that comes back after a
pulled cable (`attaching`), photocurrents as spots (`psd_view`), and all of them together as the bench that servo and
session ask (`bench`). A new kind of reading for the bench begins as a `Pump` over its device.
"""
