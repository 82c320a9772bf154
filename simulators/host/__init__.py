"""Ports of this machine on which emulated devices are served: TCP, pseudo-terminals, the loop that runs them.

`loop` advances benches and moves bytes; a new kind of line is a file beside `tcp` and `serial_line`.
"""
