"""Two recordings, or a recording and a simulation: matching of poses, what differs between them, and streams.

Open first `compare_recordings.compare`; `comparison_file` has what it finds, and `reconciled_rows` how far a simulation
is away on rows that nothing was fitted to.
"""
