"""identify: from a recording to geometry with its uncertainty, its proofs and its record in the model file."""
