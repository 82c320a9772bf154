"""Sessions with concealed mechanisms, worked out directly from one seed: the truth, the rig file and the samples.

`case.conceal` draws one and `case_files.write_case` writes it with its truth; `on_wire` is the same for a session that
emulators take. A new arm is an entry in arms.toml, a new mechanism belongs to simulators/defects.
"""
