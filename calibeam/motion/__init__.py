"""Motion by hand and for programs: `calibeam jog`, `move` and `motion`, and the drawing of a session before it runs.

Open first `by_hand.move_by_hand`. `gate_of_rig` makes the gate that every motion passes from the rig file and a model,
`robot` streams to the controller, `rehearsal` goes through a session on paper, `reachable_poses` finds candidate poses.
A new example is a function in `examples` and a line in its table.
"""
