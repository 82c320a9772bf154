"""From devices to a recording: decides when to move, when to read, and what to keep.

`wires` reads devices in threads and offers them as one `bench` (move, look, stop); `centring` finds the light and
holds the beam; `session` takes a plan of poses; `motion` plans tasks and lets nothing move but through its gate;
`guided` is for an arm that a person moves; `recording` is the file. Imports `drivers` only: what it has to know of
kinematics is passed in (`centring.believed`).
"""
