"""A measuring arm that a person moves: the session is guided by what the arm as known so far predicts.

Open first `run.run_guided`, beside which the emulated hand stands that takes the place of a person. `recorded`
connects the encoders and keeps the file whole, `judge` refits the arm and decides whether a reading is kept.
"""
