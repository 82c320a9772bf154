"""A measuring arm that a person moves: the session is guided by what the arm as known so far predicts.

Open first `run.run_guided`. `recorded` connects the encoders and keeps the file whole, `judge` and `refit` decide
whether a reading is kept, `hand` is the emulated hand that stands in for a person.
"""
