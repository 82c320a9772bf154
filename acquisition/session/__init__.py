"""A session: a plan of poses taken one after the other, held by a person, written down sample by sample.

`session` finds its poses itself from a `plan` of places, orders and spots, or takes explicit joint poses; `tracked`
takes these where a tracker reads the target. All go `stepping` from checkpoint to checkpoint under one `control`
(pause, resume, stop, abort, halt); `records` are what they leave: samples, events, progress.
"""
