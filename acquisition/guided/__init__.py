"""A measuring arm that a person moves: what to put the probe on next (`plan`), when it is still (`stillness`), what
is a reading and whether it can be (`reading`), and the session that asks for one after the other (`session`).
`touch` is the same for a robot that a person guides with a ball at its flange.
"""
