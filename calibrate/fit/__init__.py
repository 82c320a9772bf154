"""How much a row counts, and what is determined: problem, weighting, noise, rank, solvers, held-out rows, identify."""
