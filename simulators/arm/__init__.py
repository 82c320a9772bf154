"""One simulated arm, for the moving world, for sessions worked out directly and for the hand.

`kinematics` has the motions, where the links are and how a pose is reached, `statics` what weight does, `drawing` the
notations of a rig file. It shares no code with calibrate. Nothing here imports another part of simulators.
"""
