"""Sessions with concealed mechanisms, worked out directly from one seed: the truth, the rig file and the samples.

`case.conceal(Wanted(...))` draws one and `write.write_case` writes it; `reveal` states the truth; `on_wire` is the same
for a session that emulators take. A new arm is a line in `arms`, a new mechanism belongs to simulators/defects.
"""
